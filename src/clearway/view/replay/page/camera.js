// A camera that circles a target: drag to turn, shift or two fingers to shift, wheel or pinch.

const LENS = 0.8;  // Opening of the lens, radians.
const FLAT_LENS = 0.01;  // From so far that nothing leans.

class Camera {
  constructor(canvas, changed) {
    this.fov = LENS;
    this.offset = 0;  // How far the target lies right of the middle, for the cards on the left.
    this.target = [0, 0, 0];
    this.yaw = 0;       // Direction of sight seen from above, left of world x.
    this.down = 0.45;   // How far it looks down.
    this.distance = 20;
    this.pointers = new Map();
    this.changed = changed;
    this.listen(canvas);
  }

  get back() {
    const flat = Math.cos(this.down);
    return [-flat * Math.cos(this.yaw), -flat * Math.sin(this.yaw), Math.sin(this.down)];
  }

  get right() { return [Math.sin(this.yaw), -Math.cos(this.yaw), 0]; }

  get up() { return cross(this.back, this.right); }

  // How far the eye is: a narrow lens shows the same from farther away.
  get reach() { return this.distance * Math.tan(LENS / 2) / Math.tan(this.fov / 2); }

  get eye() { return plus(this.target, times(this.back, this.reach)); }

  // Metres that a pixel of the picture spans at the target.
  pixel(height) { return 2 * this.distance * Math.tan(LENS / 2) / height; }

  projection(aspect) {
    const far = this.distance * 30 + 200, flat = this.fov < LENS;
    const near = flat ? Math.max(this.reach - far, this.reach / 2) : Math.max(this.distance / 200, 0.02);
    const lens = perspective(this.fov, aspect, near, flat ? this.reach + far : far);
    lens[8] = -this.offset;
    return multiplied(lens, viewMatrix(this.right, this.up, this.back, this.eye));
  }

  // Where the line of sight through a place of the picture begins and leads; x, y from -1 to 1.
  ray(x, y, aspect) {
    const half = Math.tan(this.fov / 2), [right, up] = [(x - this.offset) * aspect * half, y * half];
    const way = plus(plus(times(this.right, right), times(this.up, up)), times(this.back, -1));
    return { from: this.eye, way: unit(way) };
  }

  // So near that a box fills what the cards leave free.
  fit(low, high, aspect) {
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((at) =>
      [0, 1, 2].map((axis) => ((at >> axis) & 1 ? high : low)[axis]));
    this.target = between(low, high, 0.5);
    for (this.distance = 1; this.distance < 5e4; this.distance *= 1.04) {
      const matrix = this.projection(aspect);
      if (corners.every((corner) => {
        const [x, y, , w] = transformed(matrix, corner);
        return w > 0 && Math.abs(x / w - this.offset) < 0.88 * (1 - this.offset) && Math.abs(y / w) < 0.82;
      })) return;
    }
  }

  turn(dx, dy) {
    this.fov = LENS;
    this.yaw -= dx * 0.006;
    this.down = Math.min(Math.max(this.down + dy * 0.006, -1.4), 1.5607);
    this.changed();
  }

  shift(dx, dy, height) {
    const metres = this.pixel(height);
    const aside = times(this.right, -dx * metres), along = times(this.up, dy * metres);
    this.target = plus(this.target, plus(aside, along));
    this.changed(true);
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.5), 5e4);
    this.changed();
  }

  listen(canvas) {
    const done = (event) => this.pointers.delete(event.pointerId);
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("pointermove", (event) => this.dragged(event, canvas.clientHeight));
    canvas.addEventListener("pointerup", done);
    canvas.addEventListener("pointercancel", done);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
    }, { passive: false });
  }

  dragged(event, height) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (this.pointers.size === 1) {
      this.pointers.set(event.pointerId, now);
      if (event.shiftKey || event.buttons & 6) this.shift(dx, dy, height);
      else this.turn(dx, dy);
      return;
    }
    const apart = () => {
      const [a, b] = [...this.pointers.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    const earlier = apart();
    this.pointers.set(event.pointerId, now);
    this.shift(dx / 2, dy / 2, height);
    this.zoom(Math.min(Math.max(earlier / Math.max(apart(), 1), 0.8), 1.25));
  }
}
