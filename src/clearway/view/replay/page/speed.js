// A vehicle with inertia: its track by speed, its observed free space, and why it was no faster.

const ABOVE_M = 1;  // Obstacles are cut so far above the flight, to look in from above.

const hasSpeeds = (run) => run.decisions.some((made) => made.speed);
const greatestSpeed = (run) => run.decisions.find((made) => made.speed)?.speed.greatest_mps ?? 0;

// Speed between a state and the next one.
function speedFrom(run, at) {
  const { state, state_s: times } = run.blocks, last = times.length - 2;
  const from = Math.min(Math.max(at, 0), last);
  const [a, b] = [from, from + 1].map((index) => [...state.subarray(6 * index, 6 * index + 3)]);
  return norm(minus(b, a)) / Math.max(times[from + 1] - times[from], 1e-6);
}

// Pieces between following places of the track, each in the colour of its speed.
function speedStrip(run, places) {
  const { ends, colours } = strip(places, COLOURS.executed), greatest = greatestSpeed(run);
  for (let at = 0; at + 1 < places.length; at++) {
    const paint = [...onScale(SCALES.speed, speedFrom(run, at) / greatest), 1].map((part) => 255 * part);
    for (const from of [8 * at, 8 * at + 4]) paint.forEach((part, index) => { colours[from + index] = part; });
  }
  return { ends, colours };
}

// Height at which obstacles are cut; none where speeds do not matter.
function cutHeight(run) {
  if (!hasSpeeds(run)) return Infinity;
  let highest = -Infinity;
  for (let at = 2; at < run.blocks.state.length; at += 6) highest = Math.max(highest, run.blocks.state[at]);
  return highest + ABOVE_M;
}

function cutAt(mesh, height) {
  for (let at = 2; at < mesh.positions.length; at += 3) {
    mesh.positions[at] = Math.min(mesh.positions[at], height);
  }
  return mesh;
}

// Observed free space at a decision, level at the vehicle's height.
function sightFan({ position_m: place, sight }) {
  const count = sight.free_m.length;
  const rim = sight.free_m.map((far, at) => plus(place,
    [far * Math.cos(2 * Math.PI * at / count), far * Math.sin(2 * Math.PI * at / count), 0]));
  return { mesh: flat(rim.map((corner, at) => [place, corner, rim[(at + 1) % count]])), rim: [...rim, rim[0]] };
}

// What the panel tells of the speed.
function speedWords({ speed, sight }) {
  if (!speed) return [];
  const pairs = [["now, next, greatest", `${[speed.now_mps, speed.next_mps, speed.greatest_mps]
    .map((value) => value.toFixed(1)).join(", ")} m/s`]];
  if (sight) {
    pairs.push(["observed free ahead", figure(sight.ahead_m, "m", 1)]);
    pairs.push(["fastest that stops within", figure(sight.cap_mps, "m/s", 1)]);
  }
  const { why } = speed;
  return [element("h2", "Speed"), list(pairs), element("p", `${why[0].toUpperCase()}${why.slice(1)}.`)];
}
