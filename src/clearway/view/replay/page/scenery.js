// What is really there: ground grid, obstacles, surveyed points, waypoints, vehicle, intruders.

class Scenery {
  constructor(run, renderer) {
    Object.assign(this, { run, renderer });
    this.extent = extentOf(run);
    this.floor = run.mission.ground_m ?? this.extent.floor;
    this.ball = renderer.mesh(roundedBox([0, 0, 0], 1, 6));
    this.cone = renderer.mesh(coneAlongX(16));
    this.craft = renderer.mesh(craftOf(run.mission, COLOURS.vehicle));
    this.terrain = run.mission.terrain ? renderer.mesh(ground(run.mission.terrain)) : null;
    this.spacing = niceBelow(Math.max(run.mission.grid.range_edges_m.at(-1) / 2, 1));
    this.ground = this.groundLines();
    this.solid = this.obstacles((one) => ["world", "both"].includes(one.known));
    this.charted = this.obstacles((one) => ["map", "rule"].includes(one.known));
    this.surveyed = this.surveyedPoints();
    const goals = [...run.mission.waypoints_m, ...run.mission.landing_m];
    const nominal = strip([run.mission.start_m, ...goals], COLOURS.waypoint, 0.55);
    this.nominal = renderer.lines(nominal.ends, nominal.colours);
    this.goals = goals;
    this.executed = this.path(COLOURS.executed);
    this.tracks = run.intruders.map((_, number) => this.track(number));
    const one = strip([[0, 0, 0], [1, 0, 0]], [1, 1, 1]);
    this.stroke = renderer.lines(one.ends, one.colours);
  }

  groundLines() {
    const { low, high } = this.extent, step = this.spacing, ends = [], colours = [];
    const from = [0, 1].map((axis) => Math.floor(low[axis] / step - 1) * step);
    const to = [0, 1].map((axis) => Math.ceil(high[axis] / step + 1) * step);
    const coarse = Math.max(1, Math.ceil(Math.max(to[0] - from[0], to[1] - from[1]) / step / 120));
    const paint = [...COLOURS.grid, 0.9].map((part) => 255 * part);
    const add = (a, b) => { ends.push(...a, ...b); colours.push(...paint, ...paint); };
    this.spacing = step * coarse;
    for (let x = from[0]; x <= to[0]; x += this.spacing) {
      add([x, from[1], this.floor], [x, to[1], this.floor]);
    }
    for (let y = from[1]; y <= to[1]; y += this.spacing) {
      add([from[0], y, this.floor], [to[0], y, this.floor]);
    }
    return this.renderer.lines(ends, colours);
  }

  obstacles(wanted) {
    // Blocks of ground are not drawn where the ground itself is.
    const hidden = (one) => this.terrain && one.name === "ground";
    const shown = this.run.mission.obstacles.filter((one) => wanted(one) && !hidden(one));
    const detail = [8, 5, 3].find((_, at) => shown.length <= [20, 80, 300][at]) ?? 2;
    return this.renderer.mesh(cutAt(merged(shown.map((one) => {
      const half = [0, 1, 2].map((axis) => (one.size_m[axis] ?? 0) / 2);
      const wide = Math.min(half[0], half[1]) > 2 * this.extent.range;
      return { mesh: roundedBox(half, one.radius_m, detail), position: one.position_m,
        attitude: one.orientation_rad, colour: [...COLOURS[wide ? "ground" : one.known], 1] };
    })), cutHeight(this.run)));
  }

  surveyedPoints() {
    const places = this.run.points("surveyed"), count = places.length / 3;
    const own = new Uint8Array(places.length);
    let low = Infinity, high = -Infinity;
    for (let at = 2; at < places.length; at += 3) {
      low = Math.min(low, places[at]);
      high = Math.max(high, places[at]);
    }
    for (let at = 0; at < count; at++) {
      const share = (places[3 * at + 2] - low) / Math.max(high - low, 1e-6);
      own.set(onScale(SCALES.height, share).map((part) => 255 * part), 3 * at);
    }
    const spans = new Uint16Array(2 * count);
    for (let at = 0; at < count; at++) spans[2 * at + 1] = 65535;
    return this.renderer.points(places, spans, own);
  }

  path(rgb) {
    const { state } = this.run.blocks, places = [];
    for (let at = 0; at < state.length; at += 6) places.push([...state.subarray(at, at + 3)]);
    const { ends, colours } = hasSpeeds(this.run) ? speedStrip(this.run, places) : strip(places, rgb);
    return this.renderer.lines(ends, colours);
  }

  track(number) {
    const rows = this.run.blocks[`intruder${number}`], places = [];
    for (let at = 0; at < rows.length; at += 7) places.push([...rows.subarray(at + 1, at + 4)]);
    const { ends, colours } = strip(places, COLOURS.intruder);
    for (let at = 1; 7 * at < rows.length; at++) {  // No line through times of silence.
      if (rows[7 * at] - rows[7 * (at - 1)] > SILENCE_S) ends.fill(0, 6 * (at - 1), 6 * at);
    }
    return this.renderer.lines(ends, colours);
  }

  drawLine(a, b, rgb, width, alpha = 1) {
    const along = minus(b, a);
    const model = new Float32Array([...along, 0, 0, 0, 0, 0, 0, 0, 0, 0, ...a, 1]);
    this.renderer.drawLines(this.stroke, width, { model, tint: [...rgb, alpha] });
  }

  drawStem(place) {
    this.drawLine(place, [place[0], place[1], this.floor], COLOURS.stem, 1, 0.8);
  }

  drawStill(show, decision) {
    const { renderer } = this;
    if (this.terrain && show.obstacles) renderer.drawMesh(this.terrain);
    else renderer.drawLines(this.ground, 1);
    if (show.obstacles) {
      renderer.drawMesh(this.solid);
      const size = this.extent.size / 400;
      renderer.drawPoints(this.surveyed, Math.min(Math.max(size, 0.08), 1.5), { decision, own: 1 });
    }
    renderer.drawLines(this.nominal, 1.5);
    for (const goal of this.goals) this.drawStem(goal);
  }

  // What can be seen through, drawn last.
  drawSheer(show, state) {
    const { renderer, run } = this;
    if (show.obstacles) renderer.drawMesh(this.charted, IDENTITY, [1, 1, 1, 0.4], false);
    for (const goal of this.goals) {
      const ball = placed(goal, [0, 0, 0], run.mission.reach_radius_m);
      renderer.drawMesh(this.ball, ball, [...COLOURS.waypoint, 0.14], false);
    }
    if (show.margin) {
      const ball = placed(state.position, [0, 0, 0], run.mission.margin_m);
      renderer.drawMesh(this.ball, ball, [...COLOURS.margin, 0.22], false);
    }
  }

  drawVehicle(state, time, camera) {
    const { at, share } = this.run.between(time);
    this.renderer.drawLines(this.executed, 3, { count: at });
    const from = this.run.blocks.state.subarray(6 * at, 6 * at + 3);
    const paint = hasSpeeds(this.run) ? onScale(SCALES.speed, speedFrom(this.run, at) / greatestSpeed(this.run))
      : COLOURS.executed;
    if (share > 0 || at > 0) this.drawLine([...from], state.position, paint, 3);
    this.renderer.drawLines(this.executed, 1.5, { first: at + 1, tint: [1.6, 1.5, 1.2, 0.28] });
    this.drawStem(state.position);
    // As large as the body, but never too small to be seen.
    const size = Math.max(this.run.mission.body_radius_m, 0.03 * camera.distance);
    const model = placed(state.position, state.attitude, size);
    this.renderer.drawMesh(this.craft, model);
  }

  drawIntruders(time, camera) {
    this.run.intruders.forEach(({ radius_m: radius }, number) => {
      const one = this.run.intruderAt(number, time);
      if (!one) return;
      const size = Math.max(radius ?? 0.3, 0.008 * camera.distance), speed = norm(one.velocity);
      this.renderer.drawLines(this.tracks[number], 2, { count: one.at, tint: [1, 1, 1, 0.7] });
      this.renderer.drawMesh(this.ball, placed(one.position, [0, 0, 0], size),
        [...COLOURS.intruder, 1]);
      this.drawStem(one.position);
      if (speed < 1e-6) return;
      const tip = plus(one.position, times(one.velocity, this.run.arrowTime));
      const attitude = [0, -Math.asin(one.velocity[2] / speed),
        Math.atan2(one.velocity[1], one.velocity[0])];
      this.drawLine(one.position, tip, COLOURS.intruder, 2.5);
      const head = placed(tip, attitude, 0.6 * size);
      this.renderer.drawMesh(this.cone, head, [...COLOURS.intruder, 1]);
    });
  }
}

const craftOf = ({ vehicle }, rgb) => (vehicle === "copter" ? copter(rgb) : aeroplane(rgb));

// The box that holds the flight, its goals and intruders, with what lies close to it.
function extentOf(run) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const add = (place) => place.forEach((value, axis) => {
    low[axis] = Math.min(low[axis], value);
    high[axis] = Math.max(high[axis], value);
  });
  const { state } = run.blocks;
  for (let at = 0; at < state.length; at += 6) add([...state.subarray(at, at + 3)]);
  [...run.mission.waypoints_m, ...run.mission.landing_m].forEach(add);
  const range = run.mission.grid.range_edges_m.at(-1);
  const size = Math.max(norm(minus(high, low)), range);
  const beneath = run.mission.obstacles
    .filter((one) => one.position_m.every((value, axis) =>
      value > low[axis] - range && value < high[axis] + range))
    .map((one) => one.position_m[2] - one.radius_m - (one.size_m[2] ?? 0) / 2);
  const floor = Math.max(Math.min(low[2] - range / 10, ...beneath), low[2] - range / 2);
  const tight = { low: [...low], high: [...high] };
  const padded = [0, 1].map((axis) => [low[axis] - range, high[axis] + range]);
  return { low: [padded[0][0], padded[1][0], low[2]], high: [padded[0][1], padded[1][1], high[2]],
    tight, size, floor, range };
}

// The largest of 1, 2 and 5 times a power of ten that is not above a number.
function niceBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((step) => step * power <= value * 1.000001) * power;
}
