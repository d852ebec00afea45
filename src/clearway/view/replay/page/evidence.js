// What the planner knew and chose at a decision: cells, reach set, plan, points, known movers.

class EvidenceView {
  constructor(run, renderer, ball) {
    Object.assign(this, { run, renderer, ball });
    this.grids = Object.fromEntries([["telling", 0.86], ["all", 0.4]].map(([which, keep]) => {
      const { mesh, centres } = cellBlocks(run.mission.grid, keep);
      return [which, { mesh: renderer.mesh(mesh), centres,
        paint: new Uint8Array(mesh.positions.length / 3 * 4) }];
    }));
    this.outline = this.fieldOfView();
    this.sets = this.reachSets();
    this.seen = this.seenPoints();
    this.painted = "";
    this.at = -2;
  }

  // Makes ready what changes from decision to decision and with the choice of colours.
  prepare(decision, show) {
    const choice = `${decision} ${show.colouring} ${show.which}`;
    if (choice !== this.painted) {
      this.painted = choice;
      this.paintCells(decision, show);
    }
    if (decision === this.at) return;
    this.at = decision;
    this.renderer.drop(this.plan, this.wayOut, this.tube, this.sight, this.rim);
    this.plan = this.wayOut = this.tube = this.sight = this.rim = null;
    if (decision < 0) return;
    const { position_m: origin, attitude_rad: attitude } = this.run.decisions[decision];
    this.model = placed(origin, [0, attitude[1], attitude[2]]);
    const { ends, colours } = strip(this.run.pathOf(decision), COLOURS.planned);
    this.plan = this.renderer.lines(ends, colours);
    const { tube_m: tube } = this.run.decisions[decision];
    if (tube?.length) this.tube = this.renderer.mesh(pipe(this.run.pathOf(decision), tube));
    if (this.run.decisions[decision].sight) {
      const { mesh, rim } = sightFan(this.run.decisions[decision]), edge = strip(rim, COLOURS.sight);
      this.sight = this.renderer.mesh(mesh);
      this.rim = this.renderer.lines(edge.ends, edge.colours);
    }
    const out = dashed(this.run.pathOf(decision, "way_out_mm"), COLOURS.wayout,
      hasSpeeds(this.run) ? 2 * this.run.mission.body_radius_m : 0);
    this.wayOut = out.ends.length ? this.renderer.lines(out.ends, out.colours) : null;
    this.paintReach(decision);
  }

  // --- cells ------------------------------------------------------------------------------

  paintCells(decision, show) {
    const coding = COLOURINGS.find(({ key }) => key === show.colouring);
    const values = coding ? this.run.cellValues(decision, coding.key) : null;
    this.shown = [];
    if (!values) return;
    const { mesh, paint } = this.grids[show.which], all = show.which === "all";
    for (let cell = 0; cell < values.length; cell++) {
      const value = values[cell] / 255;
      const passed = this.run.cellFlag(decision, cell, "passed");
      const telling = coding.telling(value, passed);
      if (!all && telling < 0.04) continue;
      const without = coding.key === "reachability" && !passed;
      const rgb = without ? [0.85, 0.87, 0.89] : onScale(SCALES[coding.scale], value);
      const alpha = all ? (without ? 0.25 : 0.72) : 0.16 + 0.5 * telling;
      const colour = [...rgb, alpha].map((part) => Math.round(255 * part));
      for (let corner = 0; corner < 36; corner++) paint.set(colour, 4 * (36 * cell + corner));
      this.shown.push(cell);
    }
    this.renderer.refill(mesh.colours, paint);
  }

  drawCells(show, eye) {
    if (!this.shown.length || this.at < 0) return;
    const { mesh, centres } = this.grids[show.which], distance = new Map();
    for (const cell of this.shown) {
      const place = transformed(this.model, centres[cell]);
      distance.set(cell, norm(minus(place, eye)));
    }
    // Far ones first, so that the nearer ones are seen through.
    this.shown.sort((a, b) => distance.get(b) - distance.get(a));
    const indices = new Uint32Array(36 * this.shown.length);
    this.shown.forEach((cell, at) => {
      for (let corner = 0; corner < 36; corner++) indices[36 * at + corner] = 36 * cell + corner;
    });
    this.renderer.refill(mesh.indices, indices, this.renderer.gl.ELEMENT_ARRAY_BUFFER);
    this.renderer.drawMesh(mesh, this.model, [1, 1, 1, 1], false, indices.length);
  }

  // Edges of the grid's outer border.
  fieldOfView() {
    const { range_edges_m: d, azimuth_edges_rad: az, elevation_edges_rad: el } =
      this.run.mission.grid;
    const far = d.at(-1), lines = { ends: [], colours: [] };
    const place = (r, a, e) =>
      [r * Math.cos(e) * Math.cos(a), r * Math.cos(e) * Math.sin(a), r * Math.sin(e)];
    const arc = (point) => Array.from({ length: 25 }, (_, at) => point(at / 24));
    const across = (e) => arc((s) => place(far, az[0] + s * (az.at(-1) - az[0]), e));
    const upward = (a) => arc((s) => place(far, a, el[0] + s * (el.at(-1) - el[0])));
    const rays = [az[0], az.at(-1)].flatMap((a) =>
      [el[0], el.at(-1)].map((e) => [place(d[0], a, e), place(far, a, e)]));
    for (const line of [across(el[0]), across(el.at(-1)), upward(az[0]), upward(az.at(-1)),
      ...rays]) {
      const { ends, colours } = strip(line, [0.35, 0.42, 0.5], 0.5);
      lines.ends.push(...ends);
      lines.colours.push(...colours);
    }
    return this.renderer.lines(lines.ends, lines.colours);
  }

  // --- reach set --------------------------------------------------------------------------

  reachSets() {
    const sets = [], { blocks } = this.run;
    for (let number = 0; blocks[`parent${number}`]; number++) {
      const parent = blocks[`parent${number}`], samples = blocks[`samples${number}`];
      const pieces = samples.length / parent.length / 3;
      const ends = new Float32Array(2 * samples.length);
      const place = (node, at) => samples.subarray(3 * (node * pieces + at)).subarray(0, 3);
      for (let node = 0; node < parent.length; node++) {
        let before = parent[node] < 0 ? [0, 0, 0] : place(parent[node], pieces - 1);
        for (let at = 0; at < pieces; at++) {
          const after = place(node, at), from = 6 * (node * pieces + at);
          ends.set(before, from);
          ends.set(after, from + 3);
          before = after;
        }
      }
      const paint = new Uint8Array(8 * parent.length * pieces);
      sets.push({ lines: this.renderer.lines(ends, paint), pieces, paint, nodes: parent.length });
    }
    return sets;
  }

  paintReach(decision) {
    const { blocks } = this.run;
    this.reach = null;
    if (!blocks.reach_of) return;
    this.reach = this.sets[blocks.reach_of[2 * decision]];
    const from = blocks.node_start[decision], { paint, pieces, nodes } = this.reach;
    for (let node = 0; node < nodes; node++) {
      const rating = blocks.node_rating[from + node] / 255;
      const colour = [...onScale(SCALES.passable, rating), 0.55].map((part) => 255 * part);
      for (let at = 0; at < 2 * pieces; at++) paint.set(colour, 4 * (2 * node * pieces + at));
    }
    this.renderer.refill(this.reach.lines.colours, paint);
  }

  drawLines(show) {
    if (this.at < 0) return;
    const model = this.model;
    if (this.run.blocks.cells) this.renderer.drawLines(this.outline, 1, { model });
    if (show.reach && this.reach) this.renderer.drawLines(this.reach.lines, 1.3, { model });
    if (show.wayout && this.wayOut) this.renderer.drawLines(this.wayOut, 4);
    if (show.plan && this.plan) this.renderer.drawLines(this.plan, 4);
  }

  // Observed free space, and where the escape comes to rest.
  drawSight(show) {
    if (this.at < 0 || !hasSpeeds(this.run)) return;
    const end = this.run.pathOf(this.at, "way_out_mm").at(-1), size = this.run.mission.body_radius_m;
    if (show.wayout && end) {
      this.renderer.drawMesh(this.ball, placed(end, [0, 0, 0], size), [...COLOURS.wayout, 0.9], false);
    }
    if (!show.sight || !this.sight) return;
    this.renderer.drawLines(this.rim, 1.5);
    this.renderer.drawMesh(this.sight, IDENTITY, [...COLOURS.sight, 0.28], false);
  }

  // Within how far of the plan the vehicle is to be expected.
  drawTube(show) {
    if (!show.plan || !this.tube || this.at < 0) return;
    this.renderer.drawMesh(this.tube, IDENTITY, [...COLOURS.planned, 0.16], false);
  }

  // --- points and movers ------------------------------------------------------------------

  seenPoints() {
    const places = this.run.points("seen");
    const spans = this.run.blocks.seen_span ?? new Uint16Array(0);
    return this.renderer.points(places, spans, new Uint8Array(places.length));
  }

  drawPoints(show) {
    if (!show.points || this.at < 0) return;
    this.renderer.drawPoints(this.seen, 0.6 * this.run.mission.voxel_m,
      { decision: this.at, now: COLOURS.seen, before: COLOURS.before });
  }

  // Movers as the planner reckons with them: where they are taken to be now, with what they may
  // have deviated since the decision.
  drawMovers(show, time) {
    if (!show.intruders || this.at < 0) return;
    const { movers = [], time_s: decided } = this.run.decisions[this.at];
    for (const mover of movers) {
      const place = plus(mover.position_m, times(mover.velocity_mps, time - decided));
      const radius = mover.radius_m + mover.growth_mps * (time - decided);
      this.renderer.drawMesh(this.ball, placed(place, [0, 0, 0], Math.max(radius, 0.05)),
        [...COLOURS.known, 0.25], false);
    }
  }
}
