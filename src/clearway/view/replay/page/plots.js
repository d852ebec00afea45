// What decisions came to, as curves over the time line, and every number under the pointer.

const ALERTS = ["none", "preventive", "corrective", "warning", "recovery"];
const alertOf = (made) => Math.max(ALERTS.indexOf(made.traffic?.level ?? "none"), 0);

// Curves of the plots: what a decision has of each; `beside` asks the margin as a dashed line.
const LANES = [
  { name: "speed", unit: "m/s", of: (made) => made.speed?.now_mps ?? null, colour: "#1f5fbf",
    beside: (made) => made.sight?.cap_mps ?? null, top: greatestSpeed, asked: "#088c82", tall: 2, ramp: true,
    note: "dashed: fastest that stops within sight" },
  { name: "clearance of the plan", unit: "m", of: (made) => made.clearance_m ?? null,
    beside: (made) => made.margin_asked_m ?? null, colour: "#4f5b67" },
  { name: "clearance kept with 95 %", unit: "m", of: (made) => made.kept_clearance_m ?? null,
    beside: (made) => made.margin_asked_m ?? null, colour: "#088c82" },
  { name: "cost", unit: "m", of: (made) => made.cost_m ?? null, colour: "#1f5fbf" },
  { name: "decision time", unit: "ms", of: (made) => made.elapsed_ms ?? null, colour: "#7b3fa0" },
  { name: "alert", unit: "", of: alertOf, most: ALERTS.length - 1, colour: "#c2186b" },
];

class Plots {
  constructor(run, ghost) {
    Object.assign(this, { run, ghost });
    this.canvas = document.getElementById("plots");
    this.readout = document.getElementById("readout");
    this.lanes = LANES.filter(({ of }) => run.decisions.some((made) => (of(made) ?? 0) !== 0));
    this.tops = [0];  // Where each lane begins, and the last one ends.
    for (const { tall = 1 } of this.lanes) this.tops.push(this.tops.at(-1) + 36 * tall);
    this.canvas.style.height = `${this.tops.at(-1)}px`;
    this.background = document.createElement("canvas");
    for (const canvas of [this.canvas, document.getElementById("timeline")]) {
      canvas.addEventListener("pointermove", (event) => this.under(event, canvas));
      canvas.addEventListener("pointerleave", () => { this.readout.hidden = true; });
    }
  }

  // Every number at a time, as [name, value].
  numbersAt(time, run = this.run) {
    const made = run.decisions[run.decisionAt(time)];
    const [obstacle, intruder] = run.distancesAt(time);
    const told = [["time", `${time.toFixed(1)} s`], ["obstacle", figure(obstacle, "m")]];
    if (run.intruders.length) told.push(["intruder", figure(intruder, "m")]);
    told.push(["margin", figure(run.mission.margin_m, "m")]);
    if (made) {
      told.push(["mode", made.mode]);
      for (const { name, unit: measure, of } of LANES) {
        if (!this.lanes.some((one) => one.name === name)) continue;
        told.push([name, name === "alert" ? ALERTS[of(made)] : figure(of(made), measure)]);
      }
    }
    return told;
  }

  words(time) { return this.numbersAt(time).map(([name, value]) => `${name} ${value}`).join(", "); }

  under(event, canvas) {
    const { left, width } = canvas.getBoundingClientRect(), { run, ghost } = this;
    const time = run.start + Math.min(Math.max((event.clientX - left) / width, 0), 1) * (run.end - run.start);
    const rows = this.numbersAt(time);
    const others = ghost ? Object.fromEntries(this.numbersAt(ghost.timeAt(time), ghost.run)) : null;
    this.readout.replaceChildren(element("table", "", "", rows.map(([name, value]) => element("tr", "", "",
      [element("th", name), element("td", value), ...(others ? [element("td", others[name] ?? "", "other")] : [])]))));
    this.readout.hidden = false;
    const most = window.innerWidth - this.readout.offsetWidth - 8;
    this.readout.style.left = `${Math.max(Math.min(event.clientX + 12, most), 8)}px`;
  }

  draw(time) {
    const scale = window.devicePixelRatio || 1, { canvas, background } = this;
    const [width, height] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
    if (width < 1 || height < 1) return;
    if (background.width !== width || background.height !== height) {
      for (const one of [canvas, background]) Object.assign(one, { width, height });
      this.lanes.forEach((lane, at) => this.drawLane(lane, at, width, scale));
    }
    const pen = canvas.getContext("2d"), { start, end } = this.run;
    pen.drawImage(background, 0, 0);
    pen.fillStyle = "#12336b";
    pen.fillRect((time - start) / Math.max(end - start, 1e-6) * width - scale, 0, 2 * scale, height);
  }

  drawLane({ name, unit: measure, of, beside, most: given, colour, top: highest, asked: paint, note,
    ramp }, at, width, scale) {
    const pen = this.background.getContext("2d"), { run, ghost } = this;
    const [begins, ends] = [this.tops[at], this.tops[at + 1]].map((edge) => edge * scale), high = ends - begins;
    const values = run.decisions.map(of), room = 13 * scale;
    const asked = beside ? Math.max(...run.decisions.map((made) => beside(made) ?? 0)) : 0;
    const finite = values.filter((one) => one !== null);
    const most = given ?? highest?.(run) ?? (beside && asked > 0 ? 5 * asked : Math.max(...finite, 1e-9));
    const place = (time) => (time - run.start) / Math.max(run.end - run.start, 1e-6) * width;
    const level = (value) => ends - 3 * scale - Math.min(value / most, 1) * (high - room - 4 * scale);
    pen.fillStyle = at % 2 ? "#f4f6f8" : "#fbfcfd";
    pen.fillRect(0, begins, width, high);
    const curve = (of_one, one, drawn, dashes, shift = (time) => time, sloped = false) => {
      pen.strokeStyle = drawn;
      pen.lineWidth = 1.4 * scale;
      pen.setLineDash(dashes.map((dash) => dash * scale));
      pen.beginPath();
      one.decisions.forEach((made, number) => {
        const value = of_one(made), from = place(shift(made.time_s));
        if (value === null) return;
        pen.moveTo(from, level(value));
        const next = one.decisions[number + 1], then = sloped && next ? of_one(next) ?? value : value;
        pen.lineTo(place(shift(next?.time_s ?? one.end)), level(then));
      });
      pen.stroke();
      pen.setLineDash([]);
    };
    if (beside) curve(beside, run, paint ?? "#a86a6a", [4, 4]);
    if (ghost) curve(of, ghost.run, css(COLOURS.beside), [2, 2], (time) => time - ghost.run.start + run.start);
    curve(of, run, colour, [], undefined, ramp);
    pen.fillStyle = "#39444f";
    pen.font = `${10.5 * scale}px system-ui, sans-serif`;
    const top = name === "alert" ? ALERTS.at(-1) : `${Number(most.toPrecision(2))} ${measure}`;
    pen.fillText(`${name}, up to ${top}${note ? `; ${note}` : ""}`, 5 * scale, begins + 10.5 * scale);
  }
}
