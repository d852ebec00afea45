// The time slider: decisions by mode, and the distance kept, over the whole flight.

const MODE_COLOURS = { navigation: "#c9d6e2", avoidance: "#e08a00", escape: "#8e44ad", hold: "#5a6b7d", narrow: "#b5651d", emergency: "#c62828",
  landing: "#2e9e4f" };

class Timeline {
  constructor(run, ghost, seek) {
    Object.assign(this, { run, ghost, seek });
    this.canvas = document.getElementById("timeline");
    const go = (event) => {
      const { left, width } = this.canvas.getBoundingClientRect();
      const share = Math.min(Math.max((event.clientX - left) / width, 0), 1);
      seek(run.start + share * (run.end - run.start));
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      go(event);
    });
    this.canvas.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
    this.background = document.createElement("canvas");
  }

  place(time) {
    const span = Math.max(this.run.end - this.run.start, 1e-6);
    return (time - this.run.start) / span * this.background.width;
  }

  draw(time, words) {
    const scale = window.devicePixelRatio || 1, { canvas, background } = this;
    const width = Math.round(canvas.clientWidth * scale);
    const height = Math.round(canvas.clientHeight * scale);
    if (width < 1 || height < 1) return;
    if (background.width !== width || background.height !== height) {
      for (const one of [canvas, background]) Object.assign(one, { width, height });
      this.drawBackground(width, height, scale);
    }
    const pen = canvas.getContext("2d"), x = Math.round(this.place(time));
    pen.drawImage(background, 0, 0);
    pen.fillStyle = "rgba(31, 95, 191, .10)";
    pen.fillRect(0, 0, x, height);
    pen.fillStyle = "#12336b";
    pen.fillRect(x - scale, 0, 2 * scale, height);
    canvas.setAttribute("aria-valuemin", this.run.start);
    canvas.setAttribute("aria-valuemax", this.run.end);
    canvas.setAttribute("aria-valuenow", time.toFixed(1));
    canvas.setAttribute("aria-valuetext", words);
  }

  drawBackground(width, height, scale) {
    const pen = this.background.getContext("2d"), { run } = this;
    pen.fillStyle = "#f4f6f8";
    pen.fillRect(0, 0, width, height);
    const strip = 8 * scale;
    run.decisions.forEach(({ mode, time_s: time }, at) => {
      const x = this.place(time), next = this.place(run.decisions[at + 1]?.time_s ?? run.end);
      pen.fillStyle = MODE_COLOURS[mode] ?? "#888";
      pen.fillRect(x, height - strip, Math.max(next - x - 0.5, scale), strip);
      if (mode === "emergency") pen.fillRect(x, 0, 1.5 * scale, height);
    });
    this.drawDistances(pen, width, height - strip - 2 * scale, scale);
  }

  // Distances up to five margins; what is farther stays at the top.
  drawDistances(pen, width, height, scale) {
    const { run } = this, most = 5 * run.mission.margin_m;
    const level = (distance) => height - Math.min(Math.max(distance, 0) / most, 1) * (height - 2 * scale);
    pen.strokeStyle = "#a86a6a";
    pen.lineWidth = scale;
    pen.setLineDash([4 * scale, 4 * scale]);
    pen.beginPath();
    pen.moveTo(0, level(run.mission.margin_m));
    pen.lineTo(width, level(run.mission.margin_m));
    pen.stroke();
    pen.setLineDash([]);
    const curves = [[run, "#4f5b67", 0, []], [run, "#c2186b", 1, []]];
    const other = this.ghost?.run;
    if (other) curves.unshift([other, css(COLOURS.beside), 0, [2, 2]], [other, css(COLOURS.beside), 1, [1, 3]]);
    curves.forEach(([{ blocks, start }, colour, column, dashes]) => {
      const times = blocks.state_s;
      pen.strokeStyle = colour;
      pen.lineWidth = 1.3 * scale;
      pen.setLineDash(dashes.map((dash) => dash * scale));
      pen.beginPath();
      let drawing = false;
      for (let at = 0; at < times.length; at++) {
        const distance = blocks.distance[2 * at + column];
        if (distance > most) { drawing = false; continue; }
        const [x, y] = [this.place(times[at] - start + run.start), level(distance)];
        if (drawing) pen.lineTo(x, y); else pen.moveTo(x, y);
        drawing = true;
      }
      pen.stroke();
      pen.setLineDash([]);
    });
    pen.fillStyle = "#39444f";
    pen.font = `${10.5 * scale}px system-ui, sans-serif`;
    pen.fillText(`distance, up to ${Number(most.toPrecision(2))} m`, 5 * scale, 10.5 * scale);
  }
}
