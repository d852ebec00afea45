// What flies, about as large as a ball of radius 1, nose along x, in a colour of its own.

const box = (half, position, attitude, colour) =>
  ({ mesh: roundedBox(half, 0, 1), position, attitude, colour });

// A flat wing: corners [x, y, z] in order around it, from both sides.
function plate(corners, colour) {
  const [a, ...rest] = corners;
  const triangles = rest.slice(1).map((c, at) => [a, rest[at], c]);
  return { mesh: flat(triangles), position: [0, 0, 0], attitude: [0, 0, 0], colour };
}

function mirrored(corners) { return corners.map(([x, y, z]) => [x, -y, z]); }

// Fuselage, wings, tailplane and fin.
function aeroplane(rgb) {
  const own = [...rgb, 1], wing = [...between(rgb, [1, 1, 1], 0.25), 1], fin = [...COLOURS.nose, 1];
  const main = [[0.3, 0.05, 0.03], [0.02, 0.98, 0.1], [-0.16, 0.98, 0.1], [-0.14, 0.05, 0.03]];
  const tail = [[-0.7, 0.03, 0.05], [-0.84, 0.36, 0.06], [-0.95, 0.36, 0.06], [-0.93, 0.03, 0.05]];
  const body = roundedBox([0.72, 0.02, 0.02], 0.1, 5);
  for (let at = 0; at < body.positions.length; at += 3) {  // Thinner towards the tail.
    const behind = Math.max(-body.positions[at] - 0.1, 0);
    for (const axis of [1, 2]) body.positions[at + axis] *= 1 - 0.75 * Math.min(behind / 0.8, 1);
  }
  return merged([
    { mesh: body, position: [0.1, 0, 0], attitude: [0, 0, 0], colour: own },
    ...[main, mirrored(main), tail, mirrored(tail)].map((corners) => plate(corners, wing)),
    plate([[-0.62, 0, 0.05], [-0.85, 0, 0.4], [-0.97, 0, 0.4], [-0.92, 0, 0.05]], fin),
  ]);
}

// Four rotors on crossed arms; the two in front in the colour of the nose.
function copter(rgb) {
  const own = [...rgb, 1], dark = [...between(rgb, [0, 0, 0], 0.35), 1], parts = [];
  parts.push({ mesh: roundedBox([0.22, 0.12, 0.04], 0.08, 4), position: [0, 0, 0],
    attitude: [0, 0, 0], colour: own });
  parts.push(box([0.09, 0.06, 0.05], [0.3, 0, -0.02], [0, 0, 0], [...COLOURS.nose, 1]));
  for (const [x, y] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    const arm = Math.atan2(y, x), place = [0.52 * x, 0.52 * y, 0.08];
    parts.push(box([0.36, 0.03, 0.025], [0.27 * x, 0.27 * y, 0.03], [0, 0, arm], dark));
    parts.push(box([0.03, 0.03, 0.05], place, [0, 0, 0], dark));
    parts.push({ mesh: disc(20), position: [place[0], place[1], 0.14], attitude: [0, 0, 0],
      colour: [...(x > 0 ? COLOURS.nose : between(rgb, [1, 1, 1], 0.45)), 0.75] });
  }
  for (const y of [-0.17, 0.17]) {
    parts.push(box([0.26, 0.02, 0.02], [0, y, -0.24], [0, 0, 0], dark));
    parts.push(box([0.02, 0.02, 0.1], [0, y, -0.15], [0, 0, 0], dark));
  }
  return merged(parts);
}

// A rotor's disc in the plane of x and y.
function disc(sides, radius = 0.4) {
  const edge = (at) => [radius * Math.cos(2 * Math.PI * at / sides),
    radius * Math.sin(2 * Math.PI * at / sides), 0];
  return flat(Array.from({ length: sides }, (_, at) => [[0, 0, 0], edge(at), edge(at + 1)]));
}

// A pipe along places with a radius at each.
function pipe(places, radii, sides = 14) {
  const mesh = { positions: [], normals: [], indices: [] };
  places.forEach((place, at) => {
    const along = unit(minus(places[Math.min(at + 1, places.length - 1)], places[Math.max(at - 1, 0)]));
    const aside = unit(Math.abs(along[2]) < 0.9 ? cross(along, [0, 0, 1]) : cross(along, [0, 1, 0]));
    const over = cross(aside, along);
    for (let side = 0; side < sides; side++) {
      const angle = 2 * Math.PI * side / sides;
      const out = plus(times(aside, Math.cos(angle)), times(over, Math.sin(angle)));
      mesh.positions.push(...plus(place, times(out, radii[at])));
      mesh.normals.push(...out);
      if (at + 1 === places.length) continue;
      const a = at * sides + side, b = at * sides + (side + 1) % sides;
      mesh.indices.push(a, b, b + sides, a, b + sides, a + sides);
    }
  });
  return mesh;
}

// Ground through heights on an even raster; nothing beside unknown ones. Heights in centimetres.
function ground({ corner_m: corner, step_m: step, rows, columns, heights_cm: heights }) {
  const mesh = { positions: [], normals: [], indices: [], colours: [] };
  const known = heights.filter((one) => one !== null);
  const low = known.reduce((a, b) => Math.min(a, b), Infinity);
  const high = known.reduce((a, b) => Math.max(a, b), -Infinity);
  const at = (row, column) => heights[Math.min(Math.max(row, 0), rows - 1) * columns
    + Math.min(Math.max(column, 0), columns - 1)];
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const own = at(row, column) ?? low;
      const rise = (a, b) => ((at(...a) ?? own) - (at(...b) ?? own)) / 200 / step;
      mesh.positions.push(corner[0] + column * step, corner[1] + row * step, own / 100);
      mesh.normals.push(...unit([rise([row, column - 1], [row, column + 1]),
        rise([row - 1, column], [row + 1, column]), 1]));
      const paint = onScale(SCALES.terrain, (own - low) / Math.max(high - low, 1));
      mesh.colours.push(...[...paint, 1].map((part) => 255 * part));
      const around = [[row, column], [row, column + 1], [row + 1, column + 1], [row + 1, column]];
      if (row + 1 === rows || column + 1 === columns) continue;
      if (around.some((place) => at(...place) === null)) continue;
      const [a, b, c, d] = around.map(([r, k]) => r * columns + k);
      mesh.indices.push(a, b, c, a, c, d);
    }
  }
  return mesh;
}
