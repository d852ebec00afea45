// The thing picked: its numbers, what they come from, why it was ruled out; and its outline.

const SHARE = (value) => (value / 255).toFixed(3);
const WORST = 4;  // Cells of a trajectory that are told.

class Picked {
  constructor(run, renderer) {
    Object.assign(this, { run, renderer });
    this.box = document.getElementById("picked");
    this.told = "";
  }

  // Told anew where the thing, the decision or a tenth of a second is another.
  show(thing, decision, time, model) {
    const key = thing ? `${thing.kind} ${thing.index} ${decision} ${time.toFixed(1)}` : "";
    if (key === this.told) return;
    this.told = key;
    this.renderer.drop(this.outline);
    this.outline = null;
    document.documentElement.dataset.picked = thing ? `${thing.kind}:${thing.index}` : "";
    this.box.hidden = !thing;
    if (!thing) return;
    const { title, parts, lines = [] } = OF_THINGS[thing.kind](this, thing.index, decision, time);
    this.box.replaceChildren(element("h2", title), ...parts);
    const ends = [], paint = [...COLOURS.picked, 1].map((part) => 255 * part), colours = [];
    for (const [a, b] of lines) { ends.push(...a, ...b); colours.push(...paint, ...paint); }
    this.model = thing.kind === "cell" || thing.kind === "trajectory" ? model : IDENTITY;
    if (ends.length) this.outline = this.renderer.lines(ends, colours);
  }

  draw() {
    if (this.outline) this.renderer.drawLines(this.outline, 3.5, { model: this.model ?? IDENTITY });
  }

  // --- a cell -----------------------------------------------------------------------------

  cell(index, decision) {
    const { run } = this, place = placeOf(run.mission.grid, index);
    const value = (key) => run.cellValues(decision, key)?.[index] ?? 0;
    const degrees = ([from, to]) => `${(from * 180 / Math.PI).toFixed(0)} to ${(to * 180 / Math.PI).toFixed(0)}°`;
    const title = `Cell ${index}: layer ${place.at[0] + 1}, column ${place.at[1] + 1}, row ${place.at[2] + 1}`;
    const rating = `${RATING}${run.mission.rating}`, below = value(rating) / 255 < run.mission.threshold;
    const yes = (name) => (run.cellFlag(decision, index, name) ? "yes" : "no");
    const parts = [list([
      ["range", `${figure(place.range[0])} to ${figure(place.range[1], "m")}`],
      ["azimuth, left", degrees(place.azimuth)], ["elevation", degrees(place.elevation)],
      ["obstacle P_O", SHARE(value("obstacle"))],
      ...[["of what was seen", "detected"], ["of the map", "map"], ["of intruders", "intruder"]]
        .map(([words, key]) => [words, SHARE(value(key))]),
      ["visibility P_V", SHARE(value("visibility"))],
      ["reachability", yes("passed") === "yes" ? SHARE(value("reachability")) : "not passed"],
      ...run.quantities.filter((key) => key.startsWith(RATING)).map((key) =>
        [`rating "${key.slice(RATING.length)}"${key === rating ? ", flown by" : ""}`, SHARE(value(key))]),
      ["seen, inflated", `${yes("seen")}, ${yes("coated")}`],
    ]), element("p", this.cellInWords(value, below, rating))];
    const tree = run.treeOf(decision);
    if (tree) parts.push(element("p", this.passing(index, decision, tree), "soft"));
    return { title, parts, lines: edgesOf(run.mission.grid, place) };
  }

  cellInWords(value, below, rating) {
    const causes = [["detected", "what was seen"], ["map", "the map"], ["intruder", "intruders"]]
      .filter(([key]) => value(key) > 12).sort((a, b) => value(b[0]) - value(a[0])).map(([, words]) => words);
    const from = causes.length ? `an obstacle by ${causes.join(", then ")}`
      : value("visibility") < 128 ? "hidden: no beam looked into it" : "seen and free";
    const held = below ? "below the threshold" : "not below the threshold";
    return `Taken as ${from}. Its rating ${SHARE(value(rating))} is ${held} of ${this.run.mission.threshold}.`;
  }

  passing(index, decision, tree) {
    const { run } = this, rating = run.ratingsOf(decision), { grid } = run.mission;
    let all = 0, enough = 0;
    const enters = tree.parent.length ? Array.from(tree.parent, () => false) : [];
    for (let node = 0; node < tree.parent.length; node++) {
      enters[node] = (tree.parent[node] >= 0 && enters[tree.parent[node]])
        || tree.legOf(node).slice(1).some((place) => cellOf(grid, place) === index);
      if (!tree.complete[node] || !enters[node]) continue;
      all += 1;
      enough += rating[node] / 255 >= run.mission.threshold;
    }
    return all ? `By their sampled places, ${all} ${all === 1 ? "trajectory passes" : "trajectories pass"} it; ${enough} rated at or above the threshold.`
      : "No trajectory of the set has a sampled place in it.";
  }

  // --- a trajectory -----------------------------------------------------------------------

  trajectory(node, decision) {
    const { run } = this, tree = run.treeOf(decision), made = run.decisions[decision];
    const nodes = tree.nodesTo(node), rating = run.ratingsOf(decision)[node];
    const names = nodes.map((one) => tree.names[tree.movement[one]]);
    const end = tree.legOf(node).at(-1), taken = node === run.chosenOf(decision);
    const parts = [element("p", inWords(names)), list([
      ["rating P_R", `${SHARE(rating)} of ${run.mission.threshold} asked`],
      ["ends", tree.complete[node] ? `at the border of the grid, ${figure(norm(end), "m")} away` : "under way"],
    ]), element("h2", taken ? "Taken" : "Why not this one"),
    element("p", taken ? made.explanation : this.whyNot(node, names, made, rating, tree))];
    parts.push(...this.worstCells(nodes, decision, tree));
    const lines = nodes.flatMap((one) => {
      const leg = tree.legOf(one);
      return leg.slice(1).map((place, at) => [leg[at], place]);
    });
    return { title: `Trajectory ${node}${taken ? " (the plan)" : ""}`, parts, lines };
  }

  whyNot(node, names, made, rating, tree) {
    if (!tree.complete[node]) return "It ends under way: longer trajectories of the set go on from here.";
    const same = made.ruled_out?.find((one) => one.movements.join() === names.join());
    if (same) {
      return `Ruled out by ${same.cause}: ${figure(same.clearance_m, "m")} clear where `
        + `${figure(made.margin_asked_m, "m")} are asked; it would have cost ${figure(same.cost_m, "m", 1)}, `
        + `the one taken ${figure(made.cost_m, "m", 1)}.`;
    }
    if (rating / 255 < this.run.mission.threshold) {
      return "Ruled out by its cells: its rating is below the threshold. The worst of them are below.";
    }
    const others = Object.values(made.ruled_out_by ?? {}).reduce((sum, one) => sum + one, 0);
    const unnamed = others - (made.ruled_out?.length ?? 0);
    return "Its cells are rated well enough; it costs more than the one taken"
      + (unnamed > 0 ? `, or is one of ${unnamed} that verification ruled out without naming them.`
        : ", or leaves no escape at its end.");
  }

  worstCells(nodes, decision, tree) {
    const { run } = this, key = `${RATING}${run.mission.rating}`, values = run.cellValues(decision, key);
    if (!values) return [];
    const passed = new Set(nodes.flatMap((one) => tree.legOf(one).slice(1)
      .map((place) => cellOf(run.mission.grid, place))).filter((cell) => cell >= 0));
    const obstacle = run.cellValues(decision, "obstacle"), seen = run.cellValues(decision, "visibility");
    const row = (tag, cells) => element("tr", "", "", cells.map((text) => element(tag, String(text))));
    const worst = [...passed].sort((a, b) => values[a] - values[b]).slice(0, WORST);
    return [element("table", "", "", [row("th", [`worst of ${passed.size} cells passed`, "rating", "P_O", "P_V"]),
      ...worst.map((cell) => row("td", [`cell ${cell}`, SHARE(values[cell]), SHARE(obstacle[cell]), SHARE(seen[cell])]))])];
  }

  // --- an obstacle, an intruder -----------------------------------------------------------

  obstacle(index, decision, time) {
    const { run } = this, one = run.mission.obstacles[index], { state, state_s: times } = run.blocks;
    let nearest = Infinity, when = 0;
    for (let at = 0; at < times.length; at++) {
      const distance = depthInside(one, [state[6 * at], state[6 * at + 1], state[6 * at + 2]]);
      if (distance < nearest) [nearest, when] = [distance, times[at]];
    }
    const known = { world: "there, not in the map", both: "there and in the map", map: "in the map alone",
      rule: "a volume that a rule keeps out of" }[one.known];
    const made = run.decisions[decision], out = made?.ruled_out_by ?? {};
    const parts = [list([
      ["what", known], ["shape", one.shape],
      ["centre x, y, z", `${one.position_m.map((value) => value.toFixed(1)).join(", ")} m`],
      ["size", `${[...one.size_m, ...(one.radius_m ? [`radius ${figure(one.radius_m)}`] : [])]
        .map((side) => (typeof side === "number" ? figure(side) : side)).join(", ")} m`],
      ["distance now", figure(depthInside(one, run.stateAt(time).position), "m")],
      ["margin asked", figure(run.mission.margin_m, "m")],
      ["nearest", `${figure(nearest, "m")} at ${when.toFixed(1)} s`],
    ])];
    const counts = ["map", "point"].filter((cause) => out[cause]).map((cause) => `${out[cause]} by ${cause}`);
    if (counts.length) parts.push(element("p", `Trajectories ruled out now: ${counts.join(", ")} (of all obstacles).`, "soft"));
    return { title: `Obstacle ${one.name || index + 1}`, parts, lines: boxEdges(one) };
  }

  intruder(index, decision, time) {
    const { run } = this, { name, radius_m: radius } = run.intruders[index], there = run.intruderAt(index, time);
    const title = `Intruder ${name}`;
    if (!there) return { title, parts: [element("p", "Not there at this time.")] };
    const own = run.stateAt(time), before = run.stateAt(time - 0.2), after = run.stateAt(time + 0.2);
    const span = Math.max(Math.min(time + 0.2, run.end) - Math.max(time - 0.2, run.start), 1e-3);
    const apart = minus(there.position, own.position);
    const drift = minus(there.velocity, times(minus(after.position, before.position), 1 / span));
    const closest = Math.max(-dot(apart, drift) / Math.max(dot(drift, drift), 1e-9), 0);
    const made = run.decisions[decision];
    const alert = made?.traffic?.alerts?.find((one) => one.intruder === name);
    const strays = made?.traffic?.strays?.[name];
    const known = made?.movers?.find((one) => one.name === name);
    const place = known && plus(known.position_m, times(known.velocity_mps, time - made.time_s));
    const size = Math.max(radius ?? 0.3, 0.3);
    const parts = [list([
      ["distance", figure(norm(apart), "m")],
      ["speed, climb", `${figure(Math.hypot(there.velocity[0], there.velocity[1]))}, ${figure(there.velocity[2], "m/s")}`],
      ["closing", figure(-dot(apart, drift) / Math.max(norm(apart), 1e-9), "m/s")],
      ["closest, if both go on", `${figure(norm(plus(apart, times(drift, closest))), "m")} in ${figure(closest, "s", 1)}`],
      ["radius", figure(radius, "m")],
      ...(alert ? [["alert", alert.level]] : []),
      ...(strays ? strays.ahead_s.map((ahead, k) => [`off straight flight in ${ahead} s (95 %)`,
        `${figure(strays.level_m[k], "m", 0)}, ${figure(strays.height_m[k], "m", 0)} of height`]) : []),
    ]), element("h2", "As the planner took it"), known ? list([
      ["off the truth", figure(norm(minus(place, there.position)), "m")],
      ["radius with what it may deviate", figure(known.radius_m + known.growth_mps * (time - made.time_s), "m")],
      ["and it grows by", figure(known.growth_mps, "m/s")],
    ]) : element("p", "This decision did not know of it.")];
    const out = made?.ruled_out_by?.intruder;
    if (out) parts.push(element("p", `Trajectories ruled out by intruders: ${out}.`, "soft"));
    return { title, parts, lines: boxEdges({ position_m: there.position, orientation_rad: [0, 0, 0],
      size_m: [], radius_m: size }) };
  }
}

const OF_THINGS = {
  cell: (picked, ...asked) => picked.cell(...asked),
  trajectory: (picked, ...asked) => picked.trajectory(...asked),
  obstacle: (picked, ...asked) => picked.obstacle(...asked),
  intruder: (picked, ...asked) => picked.intruder(...asked),
};

// Where a cell lies: its indices and edges.
function placeOf({ range_edges_m: ranges, azimuth_edges_rad: azimuths, elevation_edges_rad: elevations }, index) {
  const rows = elevations.length - 1, columns = azimuths.length - 1;
  const at = [Math.floor(index / rows / columns), Math.floor(index / rows) % columns, index % rows];
  const [range, azimuth, elevation] = [ranges, azimuths, elevations].map((edges, axis) =>
    [edges[at[axis]], edges[at[axis] + 1]]);
  return { at, range, azimuth, elevation };
}

function edgesOf(grid, { range, azimuth, elevation }) {
  const corner = (r, a, e) => [r * Math.cos(e) * Math.cos(a), r * Math.cos(e) * Math.sin(a), r * Math.sin(e)];
  return cornerPairs((i, j, k) => corner(range[i], azimuth[j], elevation[k]));
}

function boxEdges(one) {
  const r = rotation(one.orientation_rad), half = [0, 1, 2].map((axis) => (one.size_m[axis] ?? 0) / 2 + one.radius_m);
  return cornerPairs((...ijk) => {
    const own = ijk.map((side, axis) => (2 * side - 1) * half[axis]);
    return plus(one.position_m, r.map((row) => dot(row, own)));
  });
}

// The twelve edges between eight corners.
function cornerPairs(corner) {
  const pairs = [];
  for (const a of [0, 1]) {
    for (const b of [0, 1]) {
      pairs.push([corner(0, a, b), corner(1, a, b)], [corner(a, 0, b), corner(a, 1, b)], [corner(a, b, 0), corner(a, b, 1)]);
    }
  }
  return pairs;
}
