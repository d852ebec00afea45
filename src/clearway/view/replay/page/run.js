// The flight itself: unpacked from the page, and asked for moments.

const ARRAYS = { float32: Float32Array, uint8: Uint8Array, uint16: Uint16Array, int32: Int32Array };

async function unpackedRun(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const blocks = {};
  for (const [name, { type, shape, at }] of Object.entries(head.blocks)) {
    const count = shape.reduce((product, side) => product * side, 1);
    blocks[name] = new ARRAYS[type](buffer, 4 + length + at, count);
  }
  return new Run(head, blocks);
}

const SILENCE_S = 1;  // Without a place for longer than this, an intruder is not there.

class Run {
  constructor(head, blocks) {
    Object.assign(this, head);
    this.blocks = blocks;
    this.start = blocks.state_s[0];
    this.end = blocks.state_s[blocks.state_s.length - 1];
    // How far ahead arrows of intruders show: a fifth of the time to the end of the grid.
    const { grid, speed_mps: speed } = this.mission;
    this.arrowTime = Number((0.2 * grid.range_edges_m.at(-1) / speed).toPrecision(2));
    this.decisionTimes = Float32Array.from(this.decisions, (decision) => decision.time_s);
    this.cells = (this.mission.grid.range_edges_m.length - 1)
      * (this.mission.grid.azimuth_edges_rad.length - 1)
      * (this.mission.grid.elevation_edges_rad.length - 1);
  }

  // Index of the state at or before a time, and how far on the way to the next one it is.
  between(time) {
    const times = this.blocks.state_s;
    const at = Math.min(Math.max(lastNotAfter(times, time), 0), Math.max(times.length - 2, 0));
    const next = Math.min(at + 1, times.length - 1);
    const span = times[next] - times[at];
    return { at, next, share: span > 0 ? Math.min(Math.max((time - times[at]) / span, 0), 1) : 0 };
  }

  stateAt(time) {
    const { at, next, share } = this.between(time);
    const state = this.blocks.state;
    const part = (index, from) => [...state.subarray(6 * index + from, 6 * index + from + 3)];
    return {
      position: between(part(at, 0), part(next, 0), share),
      attitude: turnedBetween(part(at, 3), part(next, 3), share),
    };
  }

  // True distances to the nearest obstacle and intruder; null where there is none.
  distancesAt(time) {
    const { at, next, share } = this.between(time);
    return [0, 1].map((column) => {
      const [a, b] = [at, next].map((index) => this.blocks.distance[2 * index + column]);
      return Math.max(a, b) > 1e30 ? null : a + share * (b - a);
    });
  }

  // Index of the decision that is being flown; -1 before the first.
  decisionAt(time) { return lastNotAfter(this.decisionTimes, time + 1e-4); }

  // Where an intruder is and how fast; null while it is not there.
  intruderAt(number, time) {
    const track = this.blocks[`intruder${number}`];
    const rows = track.length / 7;
    let at = -1;
    for (let low = 0, high = rows - 1; low <= high;) {
      const middle = (low + high) >> 1;
      if (track[7 * middle] <= time + 1e-4) { at = middle; low = middle + 1; } else high = middle - 1;
    }
    if (at < 0) return null;
    const row = (index) => track.subarray(7 * index, 7 * index + 7);
    const [a, b] = [row(at), row(Math.min(at + 1, rows - 1))];
    if (Math.max(b[0], time) - a[0] > SILENCE_S && time > a[0] + 1e-3) return null;
    const share = b[0] > a[0] ? Math.min((time - a[0]) / (b[0] - a[0]), 1) : 0;
    return { at, velocity: [a[4], a[5], a[6]],
      position: between([a[1], a[2], a[3]], [b[1], b[2], b[3]], share) };
  }

  // [cells] values in 255ths of a quantity at a decision; null for planners without cells.
  cellValues(decision, key) {
    const quantity = this.quantities.indexOf(key);
    if (!this.blocks.cells || decision < 0 || quantity < 0) return null;
    const from = (decision * this.quantities.length + quantity) * this.cells;
    return this.blocks.cells.subarray(from, from + this.cells);
  }

  cellFlag(decision, cell, name) {
    const bit = this.flags.indexOf(name);
    return (this.blocks.flags[decision * this.cells + cell] >> bit) & 1;
  }

  // Places of packed points, [3 n].
  points(name) {
    const told = this[name];
    if (!told) return new Float32Array(0);
    return Float32Array.from(this.blocks[name],
      (value, at) => told.origin_m[at % 3] + told.step_m * value);
  }

  // The reach set of a decision as { parent, complete, movement, legOf }; null without one.
  treeOf(decision) {
    const { blocks } = this;
    if (!blocks.reach_of || decision < 0) return null;
    const number = blocks.reach_of[2 * decision];
    const parent = blocks[`parent${number}`], samples = blocks[`samples${number}`];
    const pieces = samples.length / parent.length / 3;
    const place = (node, at) => [...samples.subarray(3 * (node * pieces + at), 3 * (node * pieces + at) + 3)];
    return {
      parent, complete: blocks[`complete${number}`],
      names: this.movement_names[number], movement: blocks[`movement${number}`],
      legOf: (node) => [parent[node] < 0 ? [0, 0, 0] : place(parent[node], pieces - 1),
        ...Array.from({ length: pieces }, (_, at) => place(node, at))],
      nodesTo: (node) => {
        const nodes = [];
        for (let at = node; at >= 0; at = parent[at]) nodes.unshift(at);
        return nodes;
      },
    };
  }

  // The node that ends the plan of a decision; -1 without a reach set.
  chosenOf(decision) {
    return this.blocks.reach_of && decision >= 0 ? this.blocks.reach_of[2 * decision + 1] : -1;
  }

  // [nodes] ratings of a decision in 255ths.
  ratingsOf(decision) {
    const { node_start: start, node_rating: rating } = this.blocks;
    return rating.subarray(start[decision], start[decision + 1]);
  }

  // Places of the plan, or of the way out (`way_out_mm`), of a decision.
  pathOf(decision, which = "path_mm") {
    const flat = this.decisions[decision][which] ?? [];
    return Array.from({ length: flat.length / 3 },
      (_, at) => [flat[3 * at] / 1e3, flat[3 * at + 1] / 1e3, flat[3 * at + 2] / 1e3]);
  }
}

// Index of the last entry of an ascending array that is not above a value; -1 for none.
function lastNotAfter(values, value) {
  let low = 0, high = values.length - 1;
  while (low <= high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= value) low = middle + 1; else high = middle - 1;
  }
  return high;
}
