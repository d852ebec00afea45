// Text beside the picture: the flight, the moment, the decision with its reasons; and the legend.

function element(tag, text = "", className = "", children = []) {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  if (className) made.className = className;
  made.append(...children);
  const meaning = TERMS[text] ?? TERMS[children.at(-1)];
  if (meaning) made.title = meaning;
  return made;
}

// Fewer decimals for large numbers.
function figure(value, unit = "", digits = 2) {
  if (value === null || value === undefined) return "none";
  const kept = Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? Math.min(digits, 1) : digits;
  return `${value.toFixed(kept)}${unit && ` ${unit}`}`;
}

function list(pairs) {
  return element("dl", "", "", pairs.flatMap(([name, value]) =>
    [element("dt", name), element("dd", value)]));
}

// Movements with repeats counted: 2 x Left, 8 x Straight.
function inWords(movements) {
  const runs = [];
  for (const name of movements) {
    if (runs.at(-1)?.name === name) runs.at(-1).count++; else runs.push({ name, count: 1 });
  }
  return runs.map(({ name, count }) => (count === 1 ? name : `${count} × ${name}`)).join(", ");
}

// The mode's reason, and which mode it was before where the decision changed it.
function modeInWords(made) {
  const changed = made.mode_before && made.mode_before !== made.mode;
  return `Mode${changed ? `, ${made.mode_before} before` : ""}: ${made.why_mode}.`;
}

class Panel {
  constructor(run, ghost) {
    Object.assign(this, { run, ghost });
    this.other = element("div");
    this.moment = element("div");
    this.decision = element("div");
    this.at = -2;
    document.getElementById("panel").prepend(this.flight());
    document.getElementById("panel").append(this.moment, this.other, this.decision, this.keys());
  }

  flight() {
    const { mission } = this.run, { summary } = mission;
    const reached = summary.reached ? "reached" : "not reached";
    const crashed = summary.crashed_s === null ? "" : `, crashed at ${figure(summary.crashed_s, "s", 1)}`;
    return element("div", "", "", [
      element("h1", mission.name),
      element("p", `${reached}${crashed}; ${summary.time_s.toFixed(1)} s, `
        + `${figure(summary.path_length_m, "m", 1)}; ${summary.decisions} decisions, `
        + `${summary.emergencies} emergencies; planner ${mission.planner}, rating ${mission.rating}, `
        + `seed ${summary.seed}`, "soft"),
    ]);
  }

  keys() {
    return element("p", "Keys: space play, ← → decision before and after, shift ← → one second, "
      + "n next avoidance, c colouring, f follow, 1 2 3 4 views, + - speed, p panel, g plots, k what is "
      + "picked, comma and full stop the one before and after, Esc none"
      + (this.ghost ? ", x the other run leads. " : ". ")
      + "A click picks, drag turns, shift-drag or right button shifts, wheel zooms.", "keys");
  }

  show(time, state, number) {
    const [obstacle, intruder] = this.run.distancesAt(time), margin = this.run.mission.margin_m;
    const degrees = (angle) => `${(angle * 180 / Math.PI).toFixed(0)}°`;
    const speed = hasSpeeds(this.run)
      ? [["speed", figure(speedFrom(this.run, this.run.between(time).at), "m/s", 1)]] : [];
    const pairs = [
      ["time", `${time.toFixed(1)} s`], ...speed,
      ["position x, y, z", state.position.map((value) => value.toFixed(1)).join(", ") + " m"],
      ["heading, climb", `${degrees(Math.atan2(Math.sin(state.attitude[2]), Math.cos(state.attitude[2])))}, `
        + degrees(-state.attitude[1])],
      ["nearest obstacle", obstacle === null ? "none" : `${figure(obstacle, "m")}, margin ${figure(margin, "m")}`],
    ];
    if (this.run.intruders.length) {
      pairs.push(["nearest intruder", intruder === null ? "none" : figure(intruder, "m")]);
    }
    this.moment.replaceChildren(element("h2", "Now (truth)"), list(pairs));
    if (this.ghost) this.besides(time, state);
    if (number !== this.at) this.decided(number);
  }

  // The other run at the same time since its start.
  besides(time, state) {
    const { ghost } = this, own = ghost.timeAt(time), { mission, decisions } = ghost.run;
    const there = ghost.run.stateAt(own), made = decisions[ghost.run.decisionAt(own)], { summary } = mission;
    const [obstacle, intruder] = ghost.run.distancesAt(own);
    const pairs = [
      ["flight", `${summary.reached ? "reached" : "not reached"}, ${summary.time_s.toFixed(1)} s, `
        + figure(summary.path_length_m, "m", 1)],
      ["planner, seed", `${mission.planner}, ${summary.seed}`],
      ["apart from this one", figure(norm(minus(there.position, state.position)), "m")],
      ["nearest obstacle", figure(obstacle, "m")],
      ...(ghost.run.intruders.length ? [["nearest intruder", figure(intruder, "m")]] : []),
      ...(made ? [["mode", made.mode], ["now flies", inWords(made.movements)]] : []),
      ...(made?.cost_m === undefined ? [] : [["cost, clearance",
        `${figure(made.cost_m, "m", 1)}, ${figure(made.clearance_m, "m")}`]]),
    ];
    this.other.replaceChildren(element("h2", `Beside: ${mission.name}`), list(pairs));
  }

  decided(number) {
    this.at = number;
    if (number < 0) return this.decision.replaceChildren(element("h2", "No decision yet"));
    const made = this.run.decisions[number];
    const goal = `goal ${made.goal + 1} of ${this.run.mission.waypoints_m.length
      + this.run.mission.landing_m.length}`;
    const parts = [
      element("h2", `Decision ${number + 1} of ${this.run.decisions.length}, at ${made.time_s.toFixed(1)} s`),
      element("p", "", "", [element("span", made.mode, `mode ${made.mode}`), ` ${goal}`]),
      element("p", `Why now: ${made.why_now}.`, "soft"),
      ...(made.why_mode ? [element("p", modeInWords(made), "soft")] : []),
      element("p", inWords(made.movements)), ...speedWords(made),
    ];
    parts.push(...(made.basis === undefined ? [element("p", made.explanation)] : this.reasons(made)));
    const left = Object.entries(made.data_left_out ?? {});
    if (left.length) {
      parts.push(element("p", `Data left out: ${left.map(([why, n]) => `${n} ${why}`).join(", ")}`, "soft"));
    }
    this.decision.replaceChildren(...parts);
    return undefined;
  }

  reasons(made) {
    const clear = made.limited_by === "nothing" ? "nothing in reach"
      : `${figure(made.clearance_m)} of ${figure(made.margin_asked_m, "m")} asked, ${made.limited_by}`;
    const parts = [list([
      ["passes", made.side === "straight" ? "straight ahead" : `${made.side} of the way`],
      ["clearance", clear],
      ...(made.kept_clearance_m === undefined ? [] : [["kept with 95 %",
        `${figure(made.kept_clearance_m, "m")} of ${figure(made.kept_predicted_m, "m")} foreseen`]]),
      ["margin kept", figure(made.margin_kept_m, "m")],
      ["rating P_R", figure(made.rating, "", 3)],
      ["feasibility P_D", figure(made.feasibility, "", 3)],
      ["continuations", made.continuations === null ? "none" : `${(100 * made.continuations).toFixed(0)} %`],
      ["cost", figure(made.cost_m, "m", 1)],
      ["scan age", figure(made.scan_age_s, "s", 2)],
      ["computed in", figure(made.elapsed_ms, "ms", 2)],
    ]), element("h2", "Why this one"), element("p", made.explanation.split("; ")
      .filter((part) => !made.speed || !part.startsWith("speed ")).slice(2).join("; "))];
    const counts = Object.entries(made.ruled_out_by).map(([cause, n]) => `${n} by ${cause}`);
    parts.push(element("p", `${made.candidates} candidates, ${made.below_threshold} below the `
      + `rating's threshold${counts.length ? `; ruled out: ${counts.join(", ")}` : ""}.`, "soft"));
    if (made.ruled_out.length) parts.push(this.ruledOut(made.ruled_out));
    parts.push(...this.wayOut(made));
    return parts;
  }

  // The way out in hand, and the first movements after which none was found.
  wayOut(made) {
    if (made.way_out === undefined || this.run.mission.summary.escape === "off") return [];
    const way = made.way_out, parts = [element("h2", "Held escape (dashed)")];
    if (way === null) {
      parts.push(element("p", "none"));
    } else {
      const first = way.movements.length ? `${inWords(way.movements)}, then ` : "";
      parts.push(element("p", `${first}${inWords(way.loop)} again and again; `
        + `${figure(way.margin_kept_m, "m")} clear`
        + (way.certain ? "" : ", through unobserved space")));
    }
    if (made.no_way_out.length) {
      parts.push(element("p", `No escape after ${made.no_way_out.join(", ")}.`));
    }
    return parts;
  }

  ruledOut(others) {
    const row = (tag, cells) => element("tr", "", "", cells.map((text) => element(tag, text)));
    return element("table", "", "", [
      row("th", ["cheaper, ruled out", "cost", "clear", "by"]),
      ...others.map((one) => row("td", [inWords(one.movements), figure(one.cost_m, "m", 1),
        figure(one.clearance_m, "m"), one.cause])),
    ]);
  }
}

function drawLegend(show, run, ghost) {
  const parts = [], coding = COLOURINGS.find(({ key }) => key === show.colouring);
  const bar = (title, scale, ends) => {
    const canvas = element("canvas", "", "bar");
    Object.assign(canvas, { width: 230, height: 10 });
    const pen = canvas.getContext("2d");
    for (let x = 0; x < 230; x++) {
      pen.fillStyle = css(onScale(SCALES[scale], x / 229));
      pen.fillRect(x, 0, 1, 10);
    }
    parts.push(element("h2", title), canvas,
      element("div", "", "ends", ends.map((end) => element("span", end))));
  };
  if (coding && run.blocks.cells) bar(`Cells: ${coding.title}`, coding.scale, coding.ends);
  if (show.reach && run.blocks.reach_of) bar("Reach set: rating P_R", "passable", ["0 blocked", "1 safe"]);
  if (hasSpeeds(run)) bar("Flown: speed", "speed", ["0", `${greatestSpeed(run).toFixed(1)} m/s`]);
  const known = new Set(run.mission.obstacles.map((one) => one.known));
  const things = [
    ["flown", "executed", true, !hasSpeeds(run)], ["plan", "planned", true, show.plan],
    [hasSpeeds(run) ? "escape, to rest" : "held escape", "wayout", true, show.wayout && run.decisions.some((one) => one.way_out_mm?.length), true],
    ["observed free space", "sight", false, show.sight && hasSpeeds(run)],
    ["route", "waypoint", true, true], ["margin", "margin", false, show.margin],
    ["points used", "seen", false, show.points && run.seen],
    ["known before", "before", false, show.points && run.seen],
    [`intruder, ${run.arrowTime} s`, "intruder", false, run.intruders.length],
    ["the other run", "beside", true, ghost], ["its plan", "besidePlan", true, ghost && show.plan, true],
    ["tube of the plan", "planned", false, show.plan && run.decisions.some((one) => one.tube_m?.length)],
    ["intruder as known", "known", false, run.decisions.some(({ movers }) => movers?.length)],
    ["not on the map", "world", false, known.has("world")],
    ["also on the map", "both", false, known.has("both")],
    ["only on the map", "map", false, known.has("map")],
    ["keep-out volume", "rule", false, known.has("rule")],
  ].filter((thing) => thing[3]);
  parts.push(element("ul", "", "", things.map(([text, colour, thin, , dashes]) => {
    const patch = element("i", "", thin ? "thin" : ""), paint = css(COLOURS[colour]);
    patch.style.background = dashes
      ? `repeating-linear-gradient(90deg, ${paint} 0 3px, transparent 3px 5px)` : paint;
    return element("li", "", "", [patch, text]);
  })));
  document.getElementById("legend").replaceChildren(...parts);
}
