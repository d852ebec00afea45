// Names over the picture, a scale bar and the axes of the world.

const MOST_NAMES = 40;  // Names of a whole city would hide it.

class Labels {
  constructor(run, scenery) {
    Object.assign(this, { run, scenery });
    this.box = document.getElementById("labels");
    this.goals = scenery.goals.map((place, at) => this.label("waypoint", String(at + 1), place));
    this.intruders = run.intruders.map(({ name }) => this.label("intruder", name));
    const named = run.mission.obstacles.filter((one) => one.name && one.name !== "ground");
    this.obstacles = named.length > MOST_NAMES ? []
      : named.map((one) => this.label("obstacle", one.name, one.position_m));
    this.axes = document.getElementById("axes").getContext("2d");
  }

  label(kind, text, place = null) {
    const span = document.createElement("span");
    span.className = kind;
    span.textContent = text;
    this.box.append(span);
    return { span, place };
  }

  draw(show, time, camera, canvas) {
    const matrix = camera.projection(canvas.clientWidth / canvas.clientHeight);
    const put = (label, place, shown, lift = 12) => {
      const [x, y, , w] = place && shown ? transformed(matrix, place) : [0, 0, 0, -1];
      const visible = w > 0.05 && Math.abs(x) < w * 1.05 && Math.abs(y) < w * 1.05;
      label.span.style.display = visible ? "" : "none";
      if (!visible) return;
      const left = (x / w + 1) / 2 * canvas.clientWidth;
      const top = (1 - y / w) / 2 * canvas.clientHeight - lift;
      label.span.style.transform = `translate(${left}px, ${top}px) translate(-50%, -100%)`;
    };
    for (const goal of this.goals) put(goal, goal.place, show.names);
    const near = (place) => norm(minus(place, camera.target)) < 2.5 * camera.distance;
    for (const one of this.obstacles) {
      put(one, one.place, show.names && show.obstacles && near(one.place), 0);
    }
    this.intruders.forEach((label, number) => {
      const one = show.intruders ? this.run.intruderAt(number, time) : null;
      put(label, one?.position, show.names);
    });
    this.drawAxes(camera);
    this.drawScale(camera, canvas);
  }

  drawAxes(camera) {
    const { axes: pen } = this;
    pen.clearRect(0, 0, 144, 144);
    pen.font = "22px system-ui, sans-serif";
    pen.lineWidth = 4;
    const arrows = [["x", [1, 0, 0], "#b3261e"], ["y", [0, 1, 0], "#2e7d32"],
      ["z", [0, 0, 1], "#1f5fbf"]].sort((a, b) => dot(a[1], camera.back) - dot(b[1], camera.back));
    for (const [name, way, colour] of arrows) {
      const [x, y] = [dot(way, camera.right), -dot(way, camera.up)];
      pen.strokeStyle = pen.fillStyle = colour;
      pen.beginPath();
      pen.moveTo(72, 72);
      pen.lineTo(72 + 46 * x, 72 + 46 * y);
      pen.stroke();
      pen.fillText(name, 66 + 60 * x, 79 + 60 * y);
    }
  }

  drawScale(camera, canvas) {
    const pixels = 1 / camera.pixel(canvas.clientHeight);
    const length = niceBelow(130 / pixels), grid = this.scenery.spacing;
    document.getElementById("scale-bar").style.width = `${length * pixels}px`;
    document.getElementById("scale-text").textContent =
      `${inMetres(length)} at the centre, grid ${inMetres(grid)}`;
  }
}

const inMetres = (length) =>
  (length >= 1000 ? `${length / 1000} km` : `${Number(length.toPrecision(3))} m`);
