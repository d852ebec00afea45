// The address keeps the moment and what is shown:
// #t=12.5&colouring=visibility&which=all&reach=0&view=top&pick=cells&picked=cell:60&plots=1&play=1

const asked = () => new URLSearchParams(location.hash.slice(1));
const swapped = () => asked().get("swap") === "1";

function readAddress(player) {
  const given = asked(), { run } = player, { body } = document, time = Number(given.get("t") ?? NaN);
  if (Number.isFinite(time)) player.time = Math.min(Math.max(time, run.start), run.end);
  if (VIEWS[given.get("view")]) player.look(given.get("view"));
  const { colouring, which, pick } = Object.fromEntries(given);
  if (COLOURINGS.some(({ key }) => key === colouring) || colouring === "none") player.set("colouring", colouring);
  if (which === "all" || which === "telling") player.set("which", which);
  if (KINDS.includes(pick)) player.set("pick", pick);
  for (const [name] of SWITCHES) if (given.has(name)) player.set(name, given.get(name) !== "0");
  if (SPEEDS.includes(Number(given.get("speed")))) player.setSpeed(Number(given.get("speed")));
  if (given.has("panel")) body.classList.toggle("without-panel", given.get("panel") === "0");
  if ((given.get("plots") === "1") !== body.classList.contains("with-plots") && given.has("plots")) player.togglePlots();
  const [kind, index] = (given.get("picked") ?? "").split(":");
  player.picker.choose(kind in OF_THINGS ? { kind, index: Number(index) } : null);
  if (given.get("play") === "1") player.play(true);
  player.stale = true;
}

function keepAddress(player) {
  const { show, picker: { thing } } = player;
  const kept = new URLSearchParams({ t: player.time.toFixed(2), colouring: show.colouring });
  if (show.which !== "telling") kept.set("which", show.which);
  if (show.pick !== "anything") kept.set("pick", show.pick);
  for (const [name] of SWITCHES) if (show[name] !== player.usual[name]) kept.set(name, show[name] ? "1" : "0");
  if (thing) kept.set("picked", `${thing.kind}:${thing.index}`);
  const plots = document.body.classList.contains("with-plots");
  if (plots !== player.usual.plots) kept.set("plots", plots ? "1" : "0");
  if (swapped()) kept.set("swap", "1");
  try { history.replaceState(null, "", `#${kept}`); } catch { /* Pages from files may not. */ }
}
