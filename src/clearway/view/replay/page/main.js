// Puts it together: what is shown, time that passes, keys, and the address, which keeps the moment.

const SWITCHES = [["sight", "sight"], ["reach", "reach set"], ["plan", "plan"], ["wayout", "escape"], ["points", "points"],
  ["intruders", "intruders"], ["obstacles", "obstacles"], ["margin", "margin"], ["names", "names"],
  ["follow", "follow"]];
const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20];
const VIEWS = { behind: "Behind", side: "Side", top: "Top", all: "All" };

class Player {
  constructor(run, other) {
    this.run = run;
    this.canvas = document.getElementById("view");
    this.renderer = new Renderer(this.canvas);
    this.scenery = new Scenery(run, this.renderer);
    this.evidence = new EvidenceView(run, this.renderer, this.scenery.ball);
    this.ghost = other ? new Ghost(other, this.renderer, run) : null;
    this.aside = 0;  // How far the sight is turned from the way flown.
    this.camera = new Camera(this.canvas, (shifted) => {
      if (shifted) this.set("follow", false);
      this.aside = this.camera.yaw - this.way();
      this.stale = true;
    });
    this.labels = new Labels(run, this.scenery);
    this.timeline = new Timeline(run, this.ghost, (time) => this.seek(time));
    this.plots = new Plots(run, this.ghost);
    this.panel = new Panel(run, this.ghost);
    this.picked = new Picked(run, this.renderer);
    this.picker = new Picker(this, () => { this.stale = true; this.keepAddress(); });
    this.time = run.start;
    this.speed = 1;
    this.playing = false;
    this.frameMs = [];
    this.show = { colouring: run.blocks.cells ? "obstacle" : "none", which: "telling", pick: "anything", reach: true,
      plan: true, wayout: true, points: true, intruders: true, obstacles: true, margin: true, names: true,
      follow: true, sight: false };
    // Without inertia there is no sight to switch. With it, what tells why it is so fast comes first.
    if (hasSpeeds(run)) Object.assign(this.show, { colouring: "none", reach: false, points: false, sight: true });
    else SWITCHES.shift();
    this.usual = { ...this.show, plots: hasSpeeds(run) };
    this.makeControls();
    if (hasSpeeds(run)) this.togglePlots();
    this.look("behind");
    this.readAddress();
    window.addEventListener("hashchange", () => this.readAddress());
    window.addEventListener("resize", () => { this.stale = true; });
    document.addEventListener("keydown", (event) => this.pressed(event));
    this.stale = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  // --- controls ---------------------------------------------------------------------------

  makeControls() {
    const by = (name) => document.getElementById(name), { show } = this;
    const colouring = by("colouring");
    offerRatings(this.run.quantities);
    colouring.append(new Option("none", "none"),
      ...COLOURINGS.map(({ key, title }) => new Option(title, key)));
    for (const name of ["colouring", "which"]) {
      by(name).addEventListener("change", () => this.set(name, by(name).value));
      by(name).disabled = !this.run.blocks.cells;
    }
    by("pick").append(...KINDS.map((kind) => new Option(kind, kind)));
    by("pick").addEventListener("change", () => this.set("pick", by("pick").value));
    by("plots-switch").addEventListener("click", () => this.togglePlots());
    this.boxes = {};
    for (const [name, text] of SWITCHES) {
      const box = element("input");
      box.type = "checkbox";
      box.addEventListener("change", () => this.set(name, box.checked));
      this.boxes[name] = box;
      by("switches").append(element("label", "", "", [box, text]));
    }
    for (const [name, text] of Object.entries(VIEWS)) {
      const button = element("button", text);
      button.addEventListener("click", () => this.look(name));
      by("views").append(button);
    }
    by("speed").append(...SPEEDS.map((speed) => new Option(`${speed} ×`, speed)));
    by("speed").addEventListener("change", () => { this.speed = Number(by("speed").value); });
    by("play").addEventListener("click", () => this.play(!this.playing));
    by("back").addEventListener("click", () => this.step(-1));
    by("forth").addEventListener("click", () => this.step(1));
    by("panel-switch").addEventListener("click", () => this.togglePanel());
    this.setSpeed(1);
    for (const [name, value] of Object.entries(show)) this.set(name, value);
  }

  set(name, value) {
    this.show[name] = value;
    if (this.boxes[name]) this.boxes[name].checked = value;
    else if (name !== "sight") document.getElementById(name).value = value;
    drawLegend(this.show, this.run, this.ghost);
    this.stale = true;
    this.keepAddress();
  }

  setSpeed(speed) {
    this.speed = speed;
    document.getElementById("speed").value = speed;
  }

  togglePanel() {
    document.body.classList.toggle("without-panel");
    this.stale = true;
  }

  togglePlots() {
    const shown = document.body.classList.toggle("with-plots");
    document.getElementById("plots-switch").setAttribute("aria-pressed", String(shown));
    this.stale = true;
  }

  play(playing) {
    if (playing && this.time >= this.run.end - 1e-3) this.time = this.run.start;
    this.playing = playing;
    const button = document.getElementById("play");
    button.textContent = playing ? "❚❚" : "▶";
    button.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.stale = true;
    if (!playing) this.keepAddress();
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.run.start), this.run.end);
    this.stale = true;
    if (!this.playing) this.keepAddress();
  }

  // To the decision so many places further on; from between two, back goes to the one flown.
  step(by, wanted = () => true) {
    const times = this.run.decisionTimes;
    let at = this.run.decisionAt(this.time);
    if (by < 0 && at >= 0 && this.time > times[at] + 0.02) at += 1;
    do at += by; while (at >= 0 && at < times.length && !wanted(this.run.decisions[at]));
    if (at >= 0 && at < times.length) this.seek(times[at]);
  }

  // Direction of the way flown about now: smoother than the heading.
  way() {
    const { run, time } = this, range = run.mission.grid.range_edges_m.at(-1);
    const window = 0.4 * range / run.mission.speed_mps;
    const [before, after] = [-window, window].map((apart) => run.stateAt(time + apart).position);
    const [x, y] = minus(after, before);
    return Math.hypot(x, y) > 0.05 * range ? Math.atan2(y, x) : run.stateAt(time).attitude[2];
  }

  look(name) {
    const { camera, run, scenery } = this, heading = this.way();
    const range = run.mission.grid.range_edges_m.at(-1) * (hasSpeeds(run) ? 0.4 : 1);
    const views = {
      behind: { yaw: heading - 0.35, down: hasSpeeds(run) ? 0.75 : 0.48, distance: 2.1 * range },
      side: { yaw: heading + Math.PI / 2, down: 0.12, distance: 2.2 * range },
      top: { yaw: Math.PI / 2, down: Math.PI / 2, distance: 2.4 * range },
      all: { yaw: heading - 0.6, down: 0.75, distance: 1 },
    };
    Object.assign(camera, views[name], { fov: name === "top" ? FLAT_LENS : LENS });
    this.aside = camera.yaw - heading;
    this.turning = name === "behind";
    this.set("follow", name !== "all");
    if (name !== "all") return;
    this.makeRoom();
    const { low, high } = scenery.extent.tight;
    camera.fit(low, high, this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1));
  }

  // The middle of the picture is the middle of what the cards leave free.
  makeRoom() {
    const cards = document.getElementById("cards").getBoundingClientRect();
    this.camera.offset = Math.min(cards.right / Math.max(this.canvas.clientWidth, 1), 0.4);
  }

  pressed(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") return;
    const colourings = ["none", ...COLOURINGS.map(({ key }) => key)];
    const further = (step) => SPEEDS[Math.min(Math.max(SPEEDS.indexOf(this.speed) + step, 0), SPEEDS.length - 1)];
    const step = (by) => (event.shiftKey ? this.seek(this.time + by) : this.step(by));
    const keys = {
      " ": () => this.play(!this.playing),
      ArrowLeft: () => step(-1), ArrowRight: () => step(1),
      Home: () => this.seek(this.run.start), End: () => this.seek(this.run.end),
      n: () => this.step(1, ({ mode }) => ["avoidance", "escape", "hold", "narrow", "emergency"].includes(mode)),
      c: () => this.set("colouring",
        colourings[(colourings.indexOf(this.show.colouring) + 1) % colourings.length]),
      f: () => this.set("follow", !this.show.follow),
      p: () => this.togglePanel(), g: () => this.togglePlots(),
      k: () => this.set("pick", KINDS[(KINDS.indexOf(this.show.pick) + 1) % KINDS.length]),
      ".": () => this.picker.next(1), ",": () => this.picker.next(-1), Escape: () => this.picker.choose(null),
      x: () => this.swap(),
      "+": () => this.setSpeed(further(1)), "-": () => this.setSpeed(further(-1)),
      ...Object.fromEntries(Object.keys(VIEWS).map((name, at) => [at + 1, () => this.look(name)])),
    };
    const act = keys[event.key];
    if (!act || (event.key === " " && event.target.tagName === "BUTTON")) return;
    event.preventDefault();
    act();
  }

  // The other run leads: the page is opened anew with it.
  swap() {
    if (!this.ghost) return;
    const kept = new URLSearchParams(location.hash.slice(1));
    kept.set("swap", kept.get("swap") === "1" ? "0" : "1");
    location.hash = kept;
    location.reload();
  }

  readAddress() { readAddress(this); }

  keepAddress() { if (this.ready && !this.playing) keepAddress(this); }

  // --- drawing ----------------------------------------------------------------------------

  frame(now) {
    const passed = Math.min((now - (this.before ?? now)) / 1000, 0.25);
    this.before = now;
    if (this.playing) {
      this.time = Math.min(this.time + this.speed * passed, this.run.end);
      if (this.time >= this.run.end) this.play(false);
      this.stale = true;
    }
    if (this.stale) {
      this.stale = false;
      const started = performance.now();
      this.draw();
      this.report(performance.now() - started, now);
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  draw() {
    const { run, renderer, scenery, evidence, camera, show, time } = this;
    const state = run.stateAt(time), decision = run.decisionAt(time);
    if (show.follow) camera.target = state.position;
    if (show.follow && this.turning) camera.yaw = this.way() + this.aside;
    this.makeRoom();
    evidence.prepare(decision, show);
    renderer.begin(camera);
    scenery.drawStill(show, decision);
    scenery.drawVehicle(state, time, camera);
    if (show.intruders) scenery.drawIntruders(time, camera);
    this.ghost?.draw(time, camera, scenery, show);
    evidence.drawPoints(show);
    evidence.drawLines(show);
    scenery.drawSheer(show, state);
    evidence.drawSight(show);
    evidence.drawTube(show);
    evidence.drawMovers(show, time);
    evidence.drawCells(show, renderer.eye);
    this.picked.show(this.chosen(decision), decision, time, evidence.model);
    this.picked.draw();
    this.labels.draw(show, time, camera, this.canvas);
    this.timeline.draw(time, this.plots.words(time));
    this.plots.draw(time);
    this.panel.show(time, state, decision);
    document.getElementById("clock").textContent = `${time.toFixed(1)} / ${run.end.toFixed(1)} s`;
  }

  // The thing picked, if this decision has it.
  chosen(decision) {
    const { thing } = this.picker, { run } = this;
    if (!thing) return null;
    const there = { cell: decision >= 0 && run.blocks.cells ? run.cells : 0,
      trajectory: run.treeOf(decision)?.parent.length ?? 0,
      obstacle: run.mission.obstacles.length, intruder: run.intruders.length }[thing.kind];
    return thing.index >= 0 && thing.index < there ? thing : null;
  }

  // What tests and measurements read: that the page is drawn, and how fast.
  report(milliseconds, now) {
    const told = document.documentElement.dataset;
    this.ready = true;
    told.ready = "yes";
    told.time = this.time.toFixed(2);
    told.decision = String(this.run.decisionAt(this.time));
    told.cells = String(this.evidence.shown.length);
    this.frameMs.push([now, milliseconds]);
    if (this.frameMs.length > 120) this.frameMs.shift();
    const [first] = this.frameMs, frames = this.frameMs.length;
    const mean = this.frameMs.reduce((sum, [, own]) => sum + own, 0) / frames;
    told.drawMs = mean.toFixed(2);
    if (frames > 1) told.frameMs = ((now - first[0]) / (frames - 1)).toFixed(2);
  }
}

function failed(error) {
  document.documentElement.dataset.error = String(error);
  document.getElementById("message").textContent = `The flight cannot be shown: ${error}`;
}

window.addEventListener("error", (event) => failed(event.message));
window.addEventListener("unhandledrejection", (event) => failed(event.reason));
async function opened() {
  const texts = ["run", "beside"].map((name) => document.getElementById(name).textContent.trim());
  const runs = await Promise.all(texts.filter(Boolean).map(unpackedRun));
  if (runs.length > 1 && swapped()) runs.reverse();
  document.getElementById("message").textContent = "";
  window.player = new Player(...runs);
}

opened().catch(failed);
