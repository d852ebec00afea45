// The other run, in the same world and at the same time since its start: path, plan, way out, place.

class Ghost {
  constructor(run, renderer, main) {
    Object.assign(this, { run, renderer, main });
    this.craft = renderer.mesh(craftOf(run.mission, COLOURS.beside));
    const places = [], { state } = run.blocks;
    for (let at = 0; at < state.length; at += 6) places.push([...state.subarray(at, at + 3)]);
    const { ends, colours } = strip(places, COLOURS.beside);
    this.path = renderer.lines(ends, colours);
    this.at = -2;
  }

  // Its own time at a time of the run that leads.
  timeAt(time) {
    const own = this.run.start + time - this.main.start;
    return Math.min(Math.max(own, this.run.start), this.run.end);
  }

  draw(time, camera, scenery, show) {
    const { run, renderer } = this, own = this.timeAt(time);
    const state = run.stateAt(own), { at } = run.between(own);
    renderer.drawLines(this.path, 3, { count: at });
    renderer.drawLines(this.path, 1.5, { first: at, tint: [1.4, 1.4, 1.4, 0.3] });
    scenery.drawStem(state.position);
    const size = Math.max(run.mission.body_radius_m, 0.03 * camera.distance);
    renderer.drawMesh(this.craft, placed(state.position, state.attitude, size));
    this.prepare(run.decisionAt(own));
    if (show.plan && this.plan) renderer.drawLines(this.plan, 3);
    if (show.wayout && this.wayOut) renderer.drawLines(this.wayOut, 2.5);
  }

  prepare(decision) {
    if (decision === this.at) return;
    this.at = decision;
    this.renderer.drop(this.plan, this.wayOut);
    this.plan = this.wayOut = null;
    if (decision < 0) return;
    const drawn = (which, rgb) => {
      const { ends, colours } = dashed(this.run.pathOf(decision, which), rgb);
      return ends.length ? this.renderer.lines(ends, colours) : null;
    };
    this.plan = drawn("path_mm", COLOURS.besidePlan);
    this.wayOut = drawn("way_out_mm", COLOURS.wayout);
  }
}
