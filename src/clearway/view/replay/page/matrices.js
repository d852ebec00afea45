"use strict";
// 4 x 4 matrices by columns, as WebGL takes them; z is up in the world.

function multiplied(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0,
    0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
}

// From the camera's three axes (right, up, back) and its place.
function viewMatrix(right, up, back, eye) {
  return new Float32Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0,
    right[2], up[2], back[2], 0, -dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
}

// Rows of world_from_body: Rz(yaw) Ry(pitch) Rx(roll), pitch nose down positive.
function rotation(attitude) {
  const [sr, sp, sy] = attitude.map(Math.sin), [cr, cp, cy] = attitude.map(Math.cos);
  return [
    [cp * cy, cy * sr * sp - cr * sy, sr * sy + cr * cy * sp],
    [cp * sy, cr * cy + sr * sp * sy, cr * sp * sy - cy * sr],
    [-sp, cp * sr, cr * cp],
  ];
}

function placed(position, attitude = [0, 0, 0], scale = 1) {
  const r = rotation(attitude);
  return new Float32Array([
    scale * r[0][0], scale * r[1][0], scale * r[2][0], 0,
    scale * r[0][1], scale * r[1][1], scale * r[2][1], 0,
    scale * r[0][2], scale * r[1][2], scale * r[2][2], 0,
    position[0], position[1], position[2], 1]);
}

// Where a matrix takes a point: clip coordinates for a projection.
function transformed(m, [x, y, z]) {
  return [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
}

const IDENTITY = placed([0, 0, 0]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(a, 1 / Math.max(norm(a), 1e-12));
const between = (a, b, share) => plus(a, times(minus(b, a), share));
const turnedBetween = (a, b, share) =>
  a.map((angle, at) => {
    const turn = b[at] - angle;
    return angle + share * Math.atan2(Math.sin(turn), Math.cos(turn));
  });
