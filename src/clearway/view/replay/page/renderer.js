// Drawing with WebGL 2: lit surfaces, lines of a width in pixels, round points.

const SURFACE_VERTEX = `#version 300 es
in vec3 position; in vec3 normal; in vec4 colour;
uniform mat4 projection, model; uniform vec4 tint;
out vec3 v_normal, v_place; out vec4 v_colour;
void main() {
  vec4 place = model * vec4(position, 1.0);
  v_place = place.xyz; v_normal = mat3(model) * normal; v_colour = colour * tint;
  gl_Position = projection * place;
}`;
const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 v_normal, v_place; in vec4 v_colour;
uniform vec3 eye;
out vec4 fragment;
void main() {
  vec3 n = normalize(v_normal), sight = normalize(eye - v_place);
  n = dot(n, sight) < 0.0 ? -n : n;
  float sun = max(dot(n, normalize(vec3(0.35, -0.5, 0.8))), 0.0);
  float light = 0.60 + 0.12 * n.z + 0.34 * sun;
  fragment = vec4(v_colour.rgb * light, v_colour.a);
}`;
const LINE_VERTEX = `#version 300 es
in vec2 corner; in vec3 from, to; in vec4 from_colour, to_colour;
uniform mat4 projection, model; uniform vec2 viewport; uniform float width; uniform vec4 tint;
out vec4 v_colour;
const float NEAR = 0.02;
void main() {
  vec4 a = projection * model * vec4(from, 1.0), b = projection * model * vec4(to, 1.0);
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  v_colour = mix(from_colour, to_colour, corner.x) * tint;
  if (a.w < NEAR && b.w < NEAR) return;
  if (a.w < NEAR) a = mix(b, a, (b.w - NEAR) / (b.w - a.w));
  if (b.w < NEAR) b = mix(a, b, (a.w - NEAR) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * viewport;
  along = length(along) > 1e-5 ? normalize(along) : vec2(1.0, 0.0);
  vec4 end = mix(a, b, corner.x);
  vec2 across = vec2(-along.y, along.x) * corner.y + along * (corner.x - 0.5);
  gl_Position = end + vec4(across * width / viewport * end.w, -1e-4 * end.w, 0.0);
}`;
const THIN_VERTEX = `#version 300 es
in vec3 position; in vec4 colour;
uniform mat4 projection, model; uniform vec4 tint;
out vec4 v_colour;
void main() {
  v_colour = colour * tint;
  gl_Position = projection * model * vec4(position, 1.0);
}`;
const LINE_FRAGMENT = `#version 300 es
precision mediump float;
in vec4 v_colour; out vec4 fragment;
void main() { fragment = v_colour; }`;
const POINT_VERTEX = `#version 300 es
in vec3 position; in vec2 span; in vec3 own;
uniform mat4 projection; uniform float pixels, size, decision, own_share;
uniform vec3 now_colour, before_colour;
out vec4 v_colour;
void main() {
  gl_Position = projection * vec4(position, 1.0);
  bool now = span.x <= decision && decision <= span.y;
  v_colour = vec4(mix(now ? now_colour : before_colour, own, own_share), now ? 1.0 : 0.55);
  gl_PointSize = clamp(size * pixels / gl_Position.w, 1.5, 14.0) * (now ? 1.0 : 0.75);
  if (span.x > decision) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;
const POINT_FRAGMENT = `#version 300 es
precision mediump float;
in vec4 v_colour; out vec4 fragment;
void main() {
  vec2 off = 2.0 * gl_PointCoord - 1.0;
  float distance = dot(off, off);
  if (distance > 1.0) discard;
  fragment = vec4(v_colour.rgb * (1.05 - 0.35 * distance), v_colour.a);
}`;

class Renderer {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!gl) throw new Error("this browser has no WebGL 2, which the view needs");
    this.gl = gl;
    this.surface = this.program(SURFACE_VERTEX, SURFACE_FRAGMENT);
    this.line = this.program(LINE_VERTEX, LINE_FRAGMENT);
    this.thin = this.program(THIN_VERTEX, LINE_FRAGMENT);
    this.point = this.program(POINT_VERTEX, POINT_FRAGMENT);
    this.corners = this.buffer(new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]));
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.BLEND);
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
        throw new Error(gl.getShaderInfoLog(shader));
      }
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(program));
    }
    const named = (count, active, place) => Object.fromEntries(
      Array.from({ length: gl.getProgramParameter(program, count) }, (_, at) => {
        const { name } = active.call(gl, program, at);
        return [name, place.call(gl, program, name)];
      }));
    // A vertex array of its own: no attribute stays enabled on the buffer of another shader, which
    // may be deleted by then and would fail every later draw.
    return { program, attached: gl.createVertexArray(),
      uniforms: named(gl.ACTIVE_UNIFORMS, gl.getActiveUniform, gl.getUniformLocation),
      attributes: named(gl.ACTIVE_ATTRIBUTES, gl.getActiveAttrib, gl.getAttribLocation) };
  }

  buffer(data, target = this.gl.ARRAY_BUFFER) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
    return buffer;
  }

  // Gives back what meshes and lines take.
  drop(...things) {
    for (const thing of things) {
      for (const part of Object.values(thing ?? {})) {
        if (part instanceof WebGLBuffer) this.gl.deleteBuffer(part);
      }
    }
  }

  refill(buffer, data, target = this.gl.ARRAY_BUFFER) {
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.DYNAMIC_DRAW);
  }

  begin(camera) {
    const gl = this.gl, canvas = this.canvas;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * scale));
    const height = Math.max(1, Math.round(canvas.clientHeight * scale));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    this.scale = scale;
    this.eye = camera.eye;
    this.projection = camera.projection(width / height);
    // Pixels that a metre takes at a distance of one metre.
    this.pixels = height / (2 * Math.tan(camera.fov / 2));
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.933, 0.949, 0.965, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  use(shader, uniforms) {
    const gl = this.gl;
    gl.useProgram(shader.program);
    gl.bindVertexArray(shader.attached);
    for (const [name, value] of Object.entries(uniforms)) {
      const place = shader.uniforms[name];
      if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
      else if (value.length === 4) gl.uniform4fv(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else gl.uniform2fv(place, value);
    }
  }

  attribute(shader, name, buffer, size, options = {}) {
    const gl = this.gl, place = shader.attributes[name];
    const { type = gl.FLOAT, normalized = false, stride = 0, offset = 0, divisor = 0 } = options;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normalized, stride, offset);
    gl.vertexAttribDivisor(place, divisor);
  }

  // --- surfaces ---------------------------------------------------------------------------

  mesh({ positions, normals, indices, colours = null }) {
    const white = new Uint8Array(positions.length / 3 * 4).fill(255);
    return {
      positions: this.buffer(new Float32Array(positions)),
      normals: this.buffer(new Float32Array(normals)),
      colours: this.buffer(colours ? new Uint8Array(colours) : white),
      indices: this.buffer(new Uint32Array(indices), this.gl.ELEMENT_ARRAY_BUFFER),
      count: indices.length,
    };
  }

  // solid: whether it hides what is drawn later behind it.
  drawMesh(mesh, model = IDENTITY, tint = [1, 1, 1, 1], solid = true, count = mesh.count) {
    if (!count) return;
    const gl = this.gl, byte = { type: gl.UNSIGNED_BYTE, normalized: true };
    this.use(this.surface, { projection: this.projection, model, tint, eye: this.eye });
    this.attribute(this.surface, "position", mesh.positions, 3);
    this.attribute(this.surface, "normal", mesh.normals, 3);
    this.attribute(this.surface, "colour", mesh.colours, 4, byte);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    gl.depthMask(solid);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    gl.depthMask(true);
  }

  // --- lines ------------------------------------------------------------------------------

  // ends: [6 n] both ends of every piece; colours: [8 n] in 255ths.
  lines(ends, colours) {
    return { ends: this.buffer(new Float32Array(ends)), count: ends.length / 6,
      colours: this.buffer(new Uint8Array(colours)) };
  }

  drawLines(lines, width, options = {}) {
    const { model = IDENTITY, tint = [1, 1, 1, 1], first = 0, solid = false } = options;
    const count = (options.count ?? lines.count) - first;
    if (count <= 0) return;
    if (width * this.scale < 1.75) {
      this.drawThin(lines, first, count, model, tint);
      return;
    }
    const gl = this.gl, shader = this.line;
    this.use(shader, { projection: this.projection, model, tint, width: width * this.scale,
      viewport: [this.canvas.width, this.canvas.height] });
    this.attribute(shader, "corner", this.corners, 2);
    for (const [name, offset] of [["from", 0], ["to", 12]]) {
      this.attribute(shader, name, lines.ends, 3,
        { stride: 24, offset: 24 * first + offset, divisor: 1 });
    }
    for (const [name, offset] of [["from_colour", 0], ["to_colour", 4]]) {
      this.attribute(shader, name, lines.colours, 4, { type: gl.UNSIGNED_BYTE, normalized: true,
        stride: 8, offset: 8 * first + offset, divisor: 1 });
    }
    gl.depthMask(solid);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    gl.depthMask(true);
  }

  // Lines of one pixel, which cost little: the buffers hold both ends of one after the other.
  drawThin(lines, first, count, model, tint) {
    const gl = this.gl;
    this.use(this.thin, { projection: this.projection, model, tint });
    this.attribute(this.thin, "position", lines.ends, 3, { offset: 24 * first });
    this.attribute(this.thin, "colour", lines.colours, 4,
      { type: gl.UNSIGNED_BYTE, normalized: true, offset: 8 * first });
    gl.depthMask(false);
    gl.drawArrays(gl.LINES, 0, 2 * count);
    gl.depthMask(true);
  }

  // --- points -----------------------------------------------------------------------------

  // spans: [2 n] first and last decision that knew each; own: [3 n] colours in 255ths.
  points(positions, spans, own) {
    return { positions: this.buffer(positions), count: positions.length / 3,
      spans: this.buffer(spans), own: this.buffer(own) };
  }

  drawPoints(points, size, { decision = 0, now = [0, 0, 0], before = now, own = 0 }) {
    if (!points.count) return;
    const gl = this.gl;
    this.use(this.point, { projection: this.projection, pixels: this.pixels, size, decision,
      own_share: own, now_colour: now, before_colour: before });
    this.attribute(this.point, "position", points.positions, 3);
    this.attribute(this.point, "span", points.spans, 2, { type: gl.UNSIGNED_SHORT });
    this.attribute(this.point, "own", points.own, 3,
      { type: gl.UNSIGNED_BYTE, normalized: true });
    gl.drawArrays(gl.POINTS, 0, points.count);
  }
}

// Dashes along following places, of one colour: pieces as long as gaps, two of each a unit.
function dashed(places, rgb, unit = 0) {
  const length = (a, b) => norm(minus(b, a)), ends = [], colours = [];
  const whole = places.slice(1).reduce((sum, place, at) => sum + length(places[at], place), 0);
  const dash = unit || Math.max(whole / 80, 1e-6), paint = [...rgb, 1].map((part) => 255 * part);
  let flown = 0;
  for (let at = 0; at + 1 < places.length; at++) {
    const [a, b] = [places[at], places[at + 1]], piece = length(a, b);
    for (let from = 0; from < piece - 1e-9;) {
      const phase = (flown + from) % (2 * dash), solid = phase < dash;
      const to = Math.min(piece, from + Math.max((solid ? dash : 2 * dash) - phase, 1e-3 * dash));
      if (solid) {
        ends.push(...between(a, b, from / piece), ...between(a, b, to / piece));
        colours.push(...paint, ...paint);
      }
      from = to;
    }
    flown += piece;
  }
  return { ends, colours };
}

// Pieces between following places, of one colour.
function strip(places, rgb, alpha = 1) {
  const ends = [], colours = [], paint = [...rgb, alpha].map((part) => 255 * part);
  for (let at = 0; at + 1 < places.length; at++) {
    ends.push(...places[at], ...places[at + 1]);
    colours.push(...paint, ...paint);
  }
  return { ends, colours };
}
