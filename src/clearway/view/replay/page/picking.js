// What lies under a place of the picture, and what the keys go through: cells, trajectories,
// obstacles and intruders.

const KINDS = ["anything", "cells", "trajectories", "obstacles", "intruders"];
const NEAR_PX = 6;  // From the pointer, for what is thin.
const STILL_PX = 4;  // A pointer that moves farther drags.

class Picker {
  constructor(player, picked) {
    Object.assign(this, { player, picked });
    this.thing = null;
    this.again = { place: [-99, -99], number: 0 };
    const { canvas } = player;
    canvas.addEventListener("pointerdown", ({ clientX, clientY }) => { this.down = [clientX, clientY]; });
    canvas.addEventListener("pointerup", ({ clientX, clientY, button }) => {
      const [x, y] = this.down ?? [-99, -99];
      if (button === 0 && Math.hypot(clientX - x, clientY - y) < STILL_PX) this.clicked(clientX, clientY);
    });
  }

  choose(thing) {
    this.thing = thing;
    this.picked(thing);
  }

  // Another click at the same place takes what lies behind.
  clicked(clientX, clientY) {
    const { left, top } = this.player.canvas.getBoundingClientRect();
    const place = [clientX - left, clientY - top], { again } = this;
    const same = Math.hypot(place[0] - again.place[0], place[1] - again.place[1]) < STILL_PX;
    const found = this.under(...place);
    this.again = { place, number: same ? again.number + 1 : 0 };
    this.choose(found.length ? found[this.again.number % found.length] : null);
  }

  // Things of the chosen kind, the next after the one picked; by: 1 or -1.
  next(by) {
    const kind = this.player.show.pick === "anything" ? "cells" : this.player.show.pick;
    const things = this.ofKind(kind);
    if (!things.length) return this.choose(null);
    const now = things.findIndex((one) => one.kind === this.thing?.kind && one.index === this.thing.index);
    const at = now < 0 ? (by > 0 ? 0 : things.length - 1) : (now + by + things.length) % things.length;
    return this.choose(things[at]);
  }

  // In the order of the keys: cells from near to far, trajectories from the one taken by rating.
  ofKind(kind) {
    const { run, evidence, time } = this.player, decision = evidence.at;
    if (kind === "cells") {
      return [...evidence.shown].sort((a, b) => a - b).map((index) => ({ kind: "cell", index }));
    }
    if (kind === "trajectories") return trajectoriesOf(run, decision).map((index) => ({ kind: "trajectory", index }));
    if (kind === "intruders") {
      return run.intruders.map((_, index) => ({ kind: "intruder", index }))
        .filter(({ index }) => run.intruderAt(index, time));
    }
    const { position } = run.stateAt(time);
    return run.mission.obstacles.map((one, index) => ({ kind: "obstacle", index, far: depthInside(one, position) }))
      .sort((a, b) => a.far - b.far);
  }

  // --- under a place, the nearest first ---------------------------------------------------

  under(x, y) {
    const { canvas, camera, show, evidence } = this.player, wanted = show.pick;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight], aspect = width / height;
    const ray = camera.ray(2 * x / width - 1, 1 - 2 * y / height, aspect);
    const matrix = camera.projection(aspect);
    const onScreen = (place) => {
      const [a, b, , w] = transformed(matrix, place);
      return w > 0.02 ? [(a / w + 1) / 2 * width, (1 - b / w) / 2 * height, w] : null;
    };
    const asked = (kind) => wanted === "anything" || wanted === kind;
    const solid = [], thin = [];
    if (asked("intruders") && show.intruders) solid.push(...this.intrudersUnder(x, y, onScreen));
    if (asked("obstacles") && show.obstacles) solid.push(...this.obstaclesUnder(ray));
    if (evidence.at >= 0) {
      if (asked("cells")) solid.push(...this.cellsUnder(ray));
      if (asked("trajectories")) thin.push(...this.trajectoriesUnder(x, y, onScreen));
    }
    solid.sort((a, b) => a.depth - b.depth);
    return [...thin.filter((one) => one.taken), ...solid, ...thin.filter((one) => !one.taken)];
  }

  intrudersUnder(x, y, onScreen) {
    const { run, time, camera, canvas } = this.player;
    return run.intruders.flatMap(({ radius_m: radius }, index) => {
      const one = run.intruderAt(index, time), at = one && onScreen(one.position);
      if (!at) return [];
      const size = Math.max(radius ?? 0.3, 0.008 * camera.distance) / camera.pixel(canvas.clientHeight);
      const close = Math.hypot(at[0] - x, at[1] - y) < Math.max(size * camera.reach / at[2], 2 * NEAR_PX);
      return close ? [{ kind: "intruder", index, depth: norm(minus(one.position, camera.eye)) }] : [];
    });
  }

  obstaclesUnder({ from, way }) {
    return this.player.run.mission.obstacles.flatMap((one, index) => {
      const half = norm([0, 1, 2].map((axis) => one.size_m[axis] ?? 0)) / 2 + one.radius_m;
      const middle = dot(minus(one.position_m, from), way);
      if (norm(minus(plus(from, times(way, middle)), one.position_m)) > half) return [];
      for (let along = Math.max(middle - half, 0), step = 0; step < 200 && along < middle + half; step++) {
        const distance = depthInside(one, plus(from, times(way, along)));
        if (distance < 1e-3 * Math.max(along, 1)) return [{ kind: "obstacle", index, depth: along }];
        along += distance;
      }
      return [];
    });
  }

  // Shown cells that the line of sight passes, where their blocks are.
  cellsUnder({ from, way }) {
    const { run, evidence } = this.player, { grid } = run.mission, shown = new Set(evidence.shown);
    const origin = backInto(evidence.model, from), along = rotatedInto(evidence.model, way);
    const range = grid.range_edges_m.at(-1), nearest = -dot(origin, along), found = [];
    const aside = norm(plus(origin, times(along, nearest)));
    if (aside > range || !shown.size) return [];
    const reach = Math.sqrt(range * range - aside * aside), step = range / 400;
    for (let at = Math.max(nearest - reach, 0); at < nearest + reach; at += step) {
      const cell = cellOf(grid, plus(origin, times(along, at)));
      if (cell >= 0 && shown.delete(cell)) found.push({ kind: "cell", index: cell, depth: at });
    }
    return found;
  }

  trajectoriesUnder(x, y, onScreen) {
    const { run, evidence, show } = this.player, { blocks } = run, found = [];
    const toPath = (places) => {
      let nearest = Infinity, before = null;
      for (const place of places) {
        const after = onScreen(place);
        if (before && after) nearest = Math.min(nearest, pixelsApart(x, y, before, after));
        before = after;
      }
      return nearest;
    };
    const taken = run.chosenOf(evidence.at);
    if (taken >= 0 && show.plan && toPath(run.pathOf(evidence.at)) < NEAR_PX) {
      found.push({ kind: "trajectory", index: taken, taken: true });
    }
    if (!show.reach || !blocks.reach_of) return found;
    const tree = run.treeOf(evidence.at);
    let best = null;
    for (let node = 0; node < tree.parent.length; node++) {
      const apart = toPath(tree.legOf(node).map((place) => transformed(evidence.model, place)));
      if (apart < (best?.apart ?? NEAR_PX)) best = { kind: "trajectory", index: node, apart };
    }
    if (best && !found.some((one) => one.index === best.index)) found.push(best);
    return found;
  }
}

// Nodes that end a trajectory: the one taken, then by their rating.
function trajectoriesOf(run, decision) {
  const tree = run.treeOf(decision);
  if (!tree) return [];
  const taken = run.chosenOf(decision), rating = run.ratingsOf(decision);
  const ends = [...tree.complete.keys()].filter((node) => tree.complete[node] && node !== taken);
  ends.sort((a, b) => rating[b] - rating[a] || a - b);
  return taken >= 0 ? [taken, ...ends] : ends;
}

// Distance of a place from the surface of an obstacle, negative inside.
function depthInside(one, place) {
  const r = rotation(one.orientation_rad), off = minus(place, one.position_m);
  const own = [0, 1, 2].map((axis) => r[0][axis] * off[0] + r[1][axis] * off[1] + r[2][axis] * off[2]);
  const beyond = own.map((value, axis) => Math.abs(value) - (one.size_m[axis] ?? 0) / 2);
  const outside = norm(beyond.map((value) => Math.max(value, 0)));
  return outside + Math.min(Math.max(...beyond), 0) - one.radius_m;
}

// A place and a direction of the world in the frame of a model without scale.
function backInto(m, place) { return rotatedInto(m, minus(place, [m[12], m[13], m[14]])); }
function rotatedInto(m, way) {
  return [0, 1, 2].map((axis) => m[4 * axis] * way[0] + m[4 * axis + 1] * way[1] + m[4 * axis + 2] * way[2]);
}

// The cell of a place in the frame of the grid; -1 outside.
function cellOf({ range_edges_m: ranges, azimuth_edges_rad: azimuths, elevation_edges_rad: elevations }, [x, y, z]) {
  const flatly = Math.hypot(x, y);
  const within = (edges, value) => {
    const at = lastNotAfter(edges, value);
    return at >= edges.length - 1 ? -1 : at;
  };
  const i = within(ranges, Math.hypot(flatly, z)), j = within(azimuths, Math.atan2(y, x));
  const k = within(elevations, Math.atan2(z, flatly));
  if (i < 0 || j < 0 || k < 0) return -1;
  return (i * (azimuths.length - 1) + j) * (elevations.length - 1) + k;
}

function pixelsApart(x, y, [ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay], length = dx * dx + dy * dy;
  const share = length > 0 ? Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / length, 0), 1) : 0;
  return Math.hypot(ax + share * dx - x, ay + share * dy - y);
}
