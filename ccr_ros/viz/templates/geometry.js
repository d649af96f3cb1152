// SPDX-License-Identifier: Apache-2.0
// Vectors, quaternions (x, y, z, w) and the camera. Lengths in metres, z up.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const along = (a, d, s) => [a[0] + d[0] * s, a[1] + d[1] * s, a[2] + d[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scale(a, 1 / (length(a) || 1));
const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);

/** Columns of the rotation matrix of a quaternion: the frame's axes. */
function axesOf(q) {
  const [x, y, z, w] = q;
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
}

const turn = (axes, v) => along(along(scale(axes[0], v[0]), axes[1], v[1]), axes[2], v[2]);
const place = (pose, p) => add(pose.origin, turn(pose.axes, p));
const poseOf = (data) => ({ origin: data.position, axes: axesOf(data.orientation) });

/** Nearest turn between two quaternions, normalised linear: frames are close together. */
function blend(a, b, t) {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const q = a.map((v, i) => v + (sign * b[i] - v) * t);
  const norm = Math.hypot(...q) || 1;
  return q.map((v) => v / norm);
}

/** Points of a smooth curve through disk centres, perpendicular to the disks (cubic Hermite). */
function smooth(points, tangents, pieces) {
  const out = [points[0]];
  for (let i = 0; i + 1 < points.length; i++) {
    const a = points[i], b = points[i + 1], span = length(sub(b, a));
    const u = scale(tangents[i], span), v = scale(tangents[i + 1], span);
    for (let k = 1; k <= pieces; k++) {
      const t = k / pieces, t2 = t * t, t3 = t2 * t;
      const h = [2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, 3 * t2 - 2 * t3, t3 - t2];
      out.push([0, 1, 2].map((c) => h[0] * a[c] + h[1] * u[c] + h[2] * b[c] + h[3] * v[c]));
    }
  }
  return out;
}

/** A camera that turns about a target; perspective, mild enough to read lengths by eye. */
class Camera {
  constructor() {
    this.fov = 0.42;
    this.target = [0, 0, 0.1];
    this.distance = 1;
    this.width = this.height = 1;
    this.preset("iso");
  }

  preset(name) {
    const views = { iso: [0.62, 0.36], front: [0, 0], side: [-Math.PI / 2, 0], top: [-Math.PI / 2, Math.PI / 2] };
    [this.yaw, this.pitch] = views[name];
    this.update();
  }

  update() {
    const limit = Math.PI / 2;
    this.pitch = Math.max(-limit, Math.min(limit, this.pitch));
    const cp = Math.cos(this.pitch), sp = Math.sin(this.pitch), cy = Math.cos(this.yaw), sy = Math.sin(this.yaw);
    this.eye = [cp * cy, cp * sy, sp]; // from the target towards the viewer
    this.right = [-sy, cy, 0];
    this.up = cross(this.eye, this.right);
    this.focal = 0.5 * Math.min(this.width, this.height * 1.15) / Math.tan(this.fov / 2);
    this.light = unit(add(add(scale(this.eye, 0.62), scale(this.up, 0.62)), scale(this.right, -0.48)));
    this.position = along(this.target, this.eye, this.distance);
  }

  depth(p) { return this.distance - dot(sub(p, this.target), this.eye); }

  /** Screen x, y, and pixels per metre there. */
  project(p) {
    const r = sub(p, this.target);
    const s = this.focal / Math.max(1e-4, this.distance - dot(r, this.eye));
    return [this.width / 2 + dot(r, this.right) * s, this.height / 2 - dot(r, this.up) * s, s];
  }

  /** Move and zoom so that all points fill the view, less margins [px]: top, right, bottom, left. */
  fit(points, margins) {
    if (!points.length) return;
    const [top, right, bottom, left] = margins;
    const w = Math.max(40, this.width - left - right), h = Math.max(40, this.height - top - bottom);
    for (let round = 0; round < 8; round++) {
      this.update();
      let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
      for (const p of points) {
        const [x, y] = this.project(p);
        x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y);
      }
      const s = this.focal / this.distance;
      const dx = ((x0 + x1) / 2 - (left + w / 2)) / s, dy = ((y0 + y1) / 2 - (top + h / 2)) / s;
      this.target = along(along(this.target, this.right, dx), this.up, -dy);
      this.distance *= Math.max((x1 - x0) / w, (y1 - y0) / h, 0.05);
    }
    this.update();
  }
}
