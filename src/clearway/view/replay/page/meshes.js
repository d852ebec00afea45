// Triangles of solids: { positions, normals, indices } as plain arrays.

// A box of half lengths inflated by a radius: ball, capsule, rounded plate or cuboid. A ball is cut
// along its axes into eight parts, which move apart with the corners of the box.
function roundedBox(half, radius, detail) {
  const parts = radius > 0 ? detail : 1;
  const longitudes = [], latitudes = [];
  for (let quarter = 0; quarter < 4; quarter++) {
    for (let step = 0; step <= parts; step++) {
      longitudes.push({ angle: (quarter + step / parts) * Math.PI / 2, quarter });
    }
  }
  for (const sign of [-1, 1]) {
    for (let step = 0; step <= parts; step++) {
      const share = sign < 0 ? step / parts - 1 : step / parts;
      latitudes.push({ angle: share * Math.PI / 2, sign });
    }
  }
  const mesh = { positions: [], normals: [], indices: [] };
  for (const { angle: latitude, sign } of latitudes) {
    for (const { angle, quarter } of longitudes) {
      const across = Math.cos(latitude);
      const normal = [across * Math.cos(angle), across * Math.sin(angle), Math.sin(latitude)];
      const corner = [quarter === 0 || quarter === 3 ? 1 : -1, quarter < 2 ? 1 : -1, sign];
      mesh.positions.push(...normal.map((part, axis) => corner[axis] * half[axis] + radius * part));
      mesh.normals.push(...normal);
    }
  }
  const columns = longitudes.length;
  for (let row = 0; row + 1 < latitudes.length; row++) {
    for (let column = 0; column < columns; column++) {
      const a = row * columns + column, b = row * columns + (column + 1) % columns;
      mesh.indices.push(a, b, b + columns, a, b + columns, a + columns);
    }
  }
  for (const top of [0, (latitudes.length - 1) * columns]) {
    const [a, b, c, d] = [0, 1, 2, 3].map((quarter) => top + quarter * (parts + 1));
    mesh.indices.push(...(top ? [a, b, c, a, c, d] : [a, c, b, a, d, c]));
  }
  return mesh;
}

// A cone from z = 0 to 1 along x, of unit base.
function coneAlongX(sides) {
  const mesh = { positions: [], normals: [], indices: [] };
  for (let side = 0; side <= sides; side++) {
    const [c, s] = [Math.cos(2 * Math.PI * side / sides), Math.sin(2 * Math.PI * side / sides)];
    mesh.positions.push(0, c, s, 1, 0, 0);
    mesh.normals.push(0.3, c, s, 0.3, c, s);
    if (side < sides) mesh.indices.push(2 * side, 2 * side + 2, 2 * side + 1);
  }
  return mesh;
}

// Single triangles with their own normals.
function flat(triangles) {
  const mesh = { positions: [], normals: [], indices: [] };
  for (const [a, b, c] of triangles) {
    const normal = unit(cross(minus(b, a), minus(c, a)));
    for (const corner of [a, b, c]) {
      mesh.indices.push(mesh.indices.length);
      mesh.positions.push(...corner);
      mesh.normals.push(...normal);
    }
  }
  return mesh;
}

// Many meshes as one: parts are { mesh, position, attitude, colour }.
function merged(parts) {
  const whole = { positions: [], normals: [], indices: [], colours: [] };
  for (const { mesh, position, attitude, colour } of parts) {
    const first = whole.positions.length / 3, r = rotation(attitude);
    for (let at = 0; at < mesh.positions.length; at += 3) {
      const place = mesh.positions.slice(at, at + 3), normal = mesh.normals.slice(at, at + 3);
      for (let axis = 0; axis < 3; axis++) {
        whole.positions.push(position[axis] + dot(r[axis], place));
        whole.normals.push(dot(r[axis], normal));
      }
      whole.colours.push(...colour.map((part) => 255 * part));
    }
    for (const index of mesh.indices) whole.indices.push(first + index);
  }
  return whole;
}

// Corners, centres and blocks of the cells of a grid, in the grid frame. A block is its cell shrunk
// about its centre by `keep`, 36 corners of triangles each.
const BLOCK = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6,
  0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];

function cellBlocks(grid, keep) {
  const polar = (d, az, el) =>
    [d * Math.cos(el) * Math.cos(az), d * Math.cos(el) * Math.sin(az), d * Math.sin(el)];
  const [ranges, azimuths, elevations] =
    [grid.range_edges_m, grid.azimuth_edges_rad, grid.elevation_edges_rad];
  const shrunk = (edges, at, side) => {
    const middle = (edges[at] + edges[at + 1]) / 2;
    return middle + keep * (edges[at + side] - middle);
  };
  const triangles = [], centres = [];
  for (let i = 0; i + 1 < ranges.length; i++) {
    for (let j = 0; j + 1 < azimuths.length; j++) {
      for (let k = 0; k + 1 < elevations.length; k++) {
        const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => polar(
          shrunk(ranges, i, corner >> 2), shrunk(azimuths, j, (corner >> 1) & 1),
          shrunk(elevations, k, corner & 1)));
        for (let at = 0; at < 36; at += 3) {
          triangles.push([corners[BLOCK[at]], corners[BLOCK[at + 1]], corners[BLOCK[at + 2]]]);
        }
        centres.push(times(corners.reduce(plus), 1 / 8));
      }
    }
  }
  return { mesh: flat(triangles), centres };
}
