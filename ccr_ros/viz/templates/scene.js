// SPDX-License-Identifier: Apache-2.0
// The drawing: pieces sorted from far to near and painted on a 2-D canvas, so that it looks the
// same with and without a graphics card.

const PIECES = 3; // of the backbone between two disks
const RIM = 30; // corners of a disk's rim
const CIRCLE = Array.from({ length: RIM }, (_, i) => [Math.cos(i * 2 * Math.PI / RIM), Math.sin(i * 2 * Math.PI / RIM)]);

function rgb(hex) {
  const v = hex.trim().replace("#", "");
  return [0, 2, 4].map((i) => parseInt(v.slice(i, i + 2), 16));
}
const css = (c, alpha = 1) => `rgba(${c.map((v) => Math.round(Math.max(0, Math.min(255, v)))).join(",")},${alpha})`;
const WHITE = [255, 255, 255], BLACK = [8, 12, 20];
const shade = (c, light) => (light >= 1 ? mix(c, WHITE, Math.min(1, light - 1)) : mix(BLACK, c, light));

class Scene {
  constructor(canvas, data, colorOf) {
    this.canvas = canvas;
    this.ctx = canvas.getContext("2d");
    this.data = data;
    this.colorOf = colorOf;
    this.camera = new Camera();
    this.bases = data.fingers.map(poseOfBase);
    this.plate = plateOf(data.fingers, this.bases);
    this.maxForce = maxOf(data, (f) => f.contacts.map((c) => c.force));
    this.maxTension = maxOf(data, (f) => f.tensions);
    this.reach = this.everything();
  }

  /** Points that the view should hold: all fingers over time (thinned), objects, the plate. */
  everything() {
    const points = [], step = Math.max(1, Math.floor(this.data.frames.length / 30));
    this.data.frames.forEach((frame, i) => {
      if (i % step && i + 1 < this.data.frames.length) return;
      this.data.fingers.forEach((finger, k) => {
        const now = frame.fingers[finger.name];
        if (now) for (const p of now.backbone) {
          const q = place(this.bases[k], p), r = finger.disk_radius;
          points.push(along(q, [1, 0, 0], r), along(q, [1, 0, 0], -r), along(q, [0, 1, 0], r), along(q, [0, 1, 0], -r));
        }
      });
      for (const body of objectsAt(this.data, frame)) {
        const r = reachOf(body);
        if (r < 0.25) for (const d of [[r, 0, 0], [0, r, 0], [0, 0, r]]) points.push(add(body.position, d), sub(body.position, d));
      }
    });
    const { center, radius } = this.plate;
    for (const [c, s] of CIRCLE) points.push(add(center, [c * radius, s * radius, 0]));
    return points;
  }

  resize() {
    const box = this.canvas.getBoundingClientRect(), ratio = Math.min(3, window.devicePixelRatio || 1);
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    this.ratio = ratio;
    this.camera.width = box.width;
    this.camera.height = box.height;
    this.camera.update();
  }

  fit() {
    const small = this.camera.width < 520;
    this.camera.fit(this.reach, small ? [52, 20, 34, 20] : [54, 40, 46, 40]);
  }

  useTheme() {
    const style = getComputedStyle(document.documentElement);
    const get = (name) => rgb(style.getPropertyValue(name));
    this.theme = {
      metal: get("--metal"), plate: get("--plate"), grid: get("--grid"), object: get("--object"),
      objectDark: get("--object-dark"), slack: get("--slack"), contact: get("--contact"), friction: get("--friction"), text: get("--text"),
      panel: get("--panel"), dark: document.documentElement.classList.contains("dark"),
    };
  }

  /** Paint the moment `t` of the way (0..1) from frame `index` to the next. */
  draw(index, t, hidden) {
    const { ctx, camera } = this;
    ctx.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    ctx.clearRect(0, 0, camera.width, camera.height);
    ctx.lineJoin = "round";
    this.items = [];
    const frame = this.data.frames[index], next = this.data.frames[Math.min(index + 1, this.data.frames.length - 1)];
    const shadows = [];
    for (const body of objectsAt(this.data, frame)) this.addObject(body, shadows);
    this.data.fingers.forEach((finger, k) => {
      const now = frame.fingers[finger.name], then = next.fingers[finger.name];
      if (now) this.addFinger(finger, k, t > 0 && then ? between(now, then, t) : now, hidden.has(finger.name), shadows);
    });
    for (const c of frame.grip ? frame.grip.contacts : []) {
      const size = Math.hypot(...c.friction);
      if (!hidden.has(c.finger) && size > 0.02 * this.maxForce) this.addContact(c.position, scale(c.friction, 1 / size), size, this.theme.friction);
    }
    if (camera.eye[2] >= -0.02) this.drawGround(shadows);
    this.items.sort((a, b) => b.depth - a.depth);
    for (const item of this.items) { ctx.globalAlpha = item.alpha; item.paint(ctx); }
    ctx.globalAlpha = 1;
    if (camera.eye[2] < -0.02) this.drawGround([]);
    this.drawScale();
  }

  put(depth, paint, alpha = 1) { this.items.push({ depth, paint, alpha }); }

  polygon(points) {
    const path = new Path2D();
    points.forEach((p, i) => { const [x, y] = this.camera.project(p); if (i) path.lineTo(x, y); else path.moveTo(x, y); });
    path.closePath();
    return path;
  }

  drawGround(shadows) {
    const { ctx, camera, theme } = this, { center, radius } = this.plate;
    const corner = (i) => [Math.cos(i * Math.PI / 48), Math.sin(i * Math.PI / 48)]; // 96 of them
    const edge = Array.from({ length: 96 }, (_, i) => corner(i));
    const ring = (r, z) => this.polygon(edge.map(([c, s]) => add(center, [c * r, s * r, z])));
    const step = 0.02, count = Math.ceil(radius * 1.6 / step);
    ctx.lineWidth = 1;
    for (let i = -count; i <= count; i++) {
      const half = Math.sqrt(Math.max(0, (count * count - i * i))) * step;
      ctx.strokeStyle = css(theme.grid, i % 5 ? 0.35 : 0.8);
      for (const swap of [0, 1]) {
        const ends = [-half, half].map((e) => camera.project(add(center, swap ? [i * step, e, -0.006] : [e, i * step, -0.006])));
        ctx.beginPath(); ctx.moveTo(ends[0][0], ends[0][1]); ctx.lineTo(ends[1][0], ends[1][1]); ctx.stroke();
      }
    }
    const top = ring(radius, -0.001);
    ctx.fillStyle = ctx.strokeStyle = css(shade(theme.plate, 0.72));
    const steps = 5;
    for (let i = 0; i < steps; i++) ctx.fill(ring(radius, -0.006 + 0.005 * i / steps));
    ctx.fillStyle = css(theme.plate, camera.eye[2] < 0 ? 0.8 : 1);
    ctx.fill(top);
    ctx.strokeStyle = css(shade(theme.plate, theme.dark ? 1.18 : 0.86));
    ctx.stroke(top);
    ctx.save();
    ctx.clip(top);
    ctx.lineCap = "round";
    // Opaque tones, so that shadows that overlap make one; objects' below, fingers' on top.
    for (const shadow of shadows) {
      ctx.fillStyle = ctx.strokeStyle = css(shade(theme.plate, (shadow.width ? 0.86 : 0.93) - (theme.dark ? 0.12 : 0)));
      if (shadow.width) { ctx.lineWidth = shadow.width; ctx.stroke(shadow.path); } else ctx.fill(shadow.path);
    }
    ctx.restore();
  }

  shadowOf(points) { return points.map((p) => [p[0], p[1], this.plate.center[2] - 0.001]); }

  addFinger(finger, k, now, hidden, shadows) {
    const { camera, theme } = this, base = this.bases[k], alpha = hidden ? 0.16 : now.stale || !now.converged ? 0.5 : 1;
    const tint = rgb(this.colorOf(k, 0)), points = now.backbone.map((p) => place(base, p));
    const frames = now.orientations.map((q) => axesOf(q).map((a) => turn(base.axes, a)));
    const curve = smooth(points, frames.map((f) => f[2]), PIECES);
    this.addTube(curve, finger.backbone_diameter, alpha);
    const flat = new Path2D();
    this.shadowOf(curve).forEach((p, i) => { const [x, y] = camera.project(p); if (i) flat.lineTo(x, y); else flat.moveTo(x, y); });
    if (!hidden) shadows.push({ path: flat, width: finger.disk_radius * 1.3 * camera.project(points[0])[2] });
    points.forEach((p, i) => this.addDisk(p, frames[i], finger.disk_radius, tint, i === 0 ? 0.003 : 0.002, alpha));
    finger.cables.forEach((name, j) => {
      const path = now.cables[name];
      if (path) this.addCable(path.map((p) => place(base, p)), rgb(this.colorOf(k, j)), now.tensions[j], alpha);
    });
    if (hidden) return;
    for (const contact of now.contacts) this.addContact(place(base, contact.position), turn(base.axes, contact.normal), contact.force, this.theme.contact);
    if (!now.converged || now.stale) {
      const [x, y] = camera.project(points[points.length - 1]);
      this.put(-1, (ctx) => {
        ctx.font = "600 12px system-ui, sans-serif"; ctx.textAlign = "center";
        ctx.lineWidth = 3; ctx.strokeStyle = css(theme.panel); ctx.fillStyle = css(theme.contact);
        const text = now.converged ? "stale" : "not converged";
        ctx.strokeText(text, x, y - 14); ctx.fillText(text, x, y - 14);
      });
    }
  }

  addTube(curve, diameter, alpha) {
    const { camera, theme } = this;
    for (let i = 0; i + 1 < curve.length; i++) {
      const a = curve[i], b = curve[i + 1], pa = camera.project(a), pb = camera.project(b);
      const along2 = [pb[0] - pa[0], pb[1] - pa[1]], span = Math.hypot(...along2) || 1;
      const w = Math.max(2.2, diameter * pa[2]), nx = -along2[1] / span, ny = along2[0] / span;
      const side = -0.48 * nx - 0.62 * ny > 0 ? 1 : -1; // which flank the light falls on, on screen
      const grow = alpha < 1 ? 0 : 0.4 / span; // overlaps would show in a faded finger
      const line = (ctx, shift, width, color) => {
        ctx.lineWidth = width; ctx.strokeStyle = color; ctx.beginPath();
        ctx.moveTo(pa[0] + nx * shift - along2[0] * grow, pa[1] + ny * shift - along2[1] * grow);
        ctx.lineTo(pb[0] + nx * shift + along2[0] * grow, pb[1] + ny * shift + along2[1] * grow);
        ctx.stroke();
      };
      this.put(camera.depth(mix(a, b, 0.5)), (ctx) => {
        ctx.lineCap = "butt";
        line(ctx, 0, w, css(shade(theme.metal, 0.55)));
        line(ctx, side * w * 0.1, w * 0.68, css(theme.metal));
        line(ctx, side * w * 0.17, w * 0.24, css(shade(theme.metal, 1.55)));
      }, alpha);
    }
  }

  addDisk(center, axes, radius, tint, thickness, alpha) {
    const { camera, theme } = this;
    const rim = (h) => CIRCLE.map(([c, s]) => along(along(along(center, axes[0], c * radius), axes[1], s * radius), axes[2], h));
    const towards = dot(sub(camera.position, center), axes[2]) >= 0 ? 1 : -1;
    const near = rim(towards * thickness / 2), far = rim(-towards * thickness / 2);
    const color = mix(theme.dark ? [196, 204, 216] : [236, 240, 246], tint, 0.3);
    const light = Math.max(0, dot(scale(axes[2], towards), camera.light));
    // The wall's visible half is one band of corners: find where it begins.
    const facing = CIRCLE.map(([c, q]) => dot(add(scale(axes[0], c), scale(axes[1], q)), camera.eye) > 0);
    const start = facing.findIndex((seen, i) => seen && !facing[(i + RIM - 1) % RIM]), band = [];
    for (let i = Math.max(0, start); band.length <= RIM && (facing[i % RIM] || start < 0); i++) band.push(i % RIM);
    const wall = this.polygon([...band.map((i) => near[i]), ...band.reverse().map((i) => far[i])]);
    const face = this.polygon(near);
    const mark = camera.project(along(along(center, axes[0], radius * 0.72), axes[2], towards * thickness / 2));
    this.put(camera.depth(center), (ctx) => {
      ctx.lineWidth = 0.8;
      ctx.fillStyle = ctx.strokeStyle = css(shade(color, 0.62)); ctx.fill(wall);
      if (alpha === 1) ctx.stroke(wall);
      ctx.fillStyle = css(shade(color, 0.74 + 0.3 * light)); ctx.fill(face);
      ctx.lineWidth = 1; ctx.strokeStyle = css(shade(mix(color, tint, 0.5), 0.6), 0.8); ctx.stroke(face);
      ctx.fillStyle = css(shade(color, 0.5), 0.55); // hole 1, towards the disk's x axis
      ctx.beginPath(); ctx.arc(mark[0], mark[1], Math.max(0.8, 0.0008 * mark[2]), 0, 7); ctx.fill();
    }, alpha);
  }

  addCable(path, color, tension, alpha) {
    const { camera, theme } = this, taut = tension > 0;
    const share = this.maxTension > 0 ? tension / this.maxTension : 0;
    const width = taut ? 1.7 + 1.7 * share : 1.5;
    let run = 0;
    for (let i = 0; i + 1 < path.length; i++) {
      for (const [u, v] of [[0, 0.5], [0.5, 1]]) {
        const a = mix(path[i], path[i + 1], u), b = mix(path[i], path[i + 1], v);
        const pa = camera.project(a), pb = camera.project(b), start = run;
        run += Math.hypot(pb[0] - pa[0], pb[1] - pa[1]);
        // A little nearer than the rim it runs along, so that the disk's edge does not hide it.
        this.put(camera.depth(mix(a, b, 0.5)) - 0.0006, (ctx) => {
          ctx.lineCap = taut && alpha === 1 ? "round" : "butt";
          ctx.setLineDash(taut ? [] : [4, 3.5]); ctx.lineDashOffset = start;
          ctx.lineWidth = width; ctx.strokeStyle = css(taut ? color : mix(theme.slack, color, 0.35));
          ctx.beginPath(); ctx.moveTo(pa[0], pa[1]); ctx.lineTo(pb[0], pb[1]); ctx.stroke();
          ctx.setLineDash([]);
        }, alpha);
      }
    }
  }

  /** An arrow as long as a force, from where it acts; tint: its colour. */
  addContact(position, normal, force, tint) {
    const { camera, theme } = this, share = this.maxForce > 0 ? force / this.maxForce : 0;
    const tip = along(position, normal, 0.012 + 0.024 * share);
    const p = camera.project(position), q = camera.project(tip);
    const dx = q[0] - p[0], dy = q[1] - p[1], span = Math.hypot(dx, dy), head = Math.min(10, span * 0.6);
    const ux = dx / (span || 1), uy = dy / (span || 1);
    this.put(camera.depth(tip) - 0.004, (ctx) => {
      ctx.lineCap = "butt";
      for (const [color, w] of [[css(theme.panel, 0.85), 5.2], [css(tint), 2.8]]) {
        ctx.strokeStyle = ctx.fillStyle = color; ctx.lineWidth = w; ctx.beginPath();
        ctx.moveTo(p[0], p[1]); ctx.lineTo(q[0] - ux * head, q[1] - uy * head); ctx.stroke();
        const grow = w > 4 ? 1.4 : 0, hw = head * 0.48 + grow;
        ctx.beginPath(); ctx.moveTo(q[0] + ux * grow, q[1] + uy * grow);
        ctx.lineTo(q[0] - ux * (head + grow) - uy * hw, q[1] - uy * (head + grow) + ux * hw);
        ctx.lineTo(q[0] - ux * (head + grow) + uy * hw, q[1] - uy * (head + grow) - ux * hw); ctx.closePath(); ctx.fill();
      }
      ctx.beginPath(); ctx.arc(p[0], p[1], 4.4, 0, 7); ctx.fillStyle = css(theme.contact); ctx.fill();
      ctx.lineWidth = 1.5; ctx.strokeStyle = css(theme.panel); ctx.stroke();
    });
  }

  addObject(body, shadows) {
    const pose = { origin: body.position, axes: axesOf(body.orientation) };
    if (body.kind === "sphere") this.addSphere(pose, body.dimensions[0], shadows);
    else this.addSolid(pose, facesOf(body), shadows);
  }

  addSphere(pose, radius, shadows) {
    const { camera, theme } = this, away = sub(camera.position, pose.origin), d = length(away);
    if (d <= radius * 1.02) return;
    const [x, y, s] = camera.project(pose.origin), r = radius * s / Math.sqrt(1 - (radius / d) ** 2);
    const lit = [dot(camera.light, camera.right), -dot(camera.light, camera.up)];
    const rings = sphereRings(pose, radius).map((ring) => {
      const path = new Path2D();
      let open = false;
      for (const p of ring) {
        if (dot(sub(p, pose.origin), away) < radius * radius) { open = false; continue; }
        const q = camera.project(p);
        if (open) path.lineTo(q[0], q[1]); else path.moveTo(q[0], q[1]);
        open = true;
      }
      return path;
    });
    // The plane of the sphere's outline decides what is before it and what behind.
    this.put(camera.depth(pose.origin) - radius * radius / d, (ctx) => {
      const fill = ctx.createRadialGradient(x + lit[0] * r * 0.55, y + lit[1] * r * 0.55, r * 0.05, x, y, r);
      fill.addColorStop(0, css(shade(theme.object, 1.5), 0.86));
      fill.addColorStop(0.45, css(theme.object, 0.84));
      fill.addColorStop(1, css(theme.objectDark, 0.9));
      ctx.fillStyle = fill; ctx.beginPath(); ctx.arc(x, y, r, 0, 7); ctx.fill();
      ctx.lineWidth = 1; ctx.strokeStyle = css(shade(theme.objectDark, 0.6), 0.16);
      for (const ring of rings) ctx.stroke(ring);
      ctx.strokeStyle = css(shade(theme.objectDark, 0.7), 0.6); ctx.beginPath(); ctx.arc(x, y, r, 0, 7); ctx.stroke();
    });
    shadows.push({ path: this.polygon(this.shadowOf(CIRCLE.map(([c, q]) => add(pose.origin, [c * radius, q * radius, 0])))) });
  }

  addSolid(pose, faces, shadows) {
    const { camera, theme } = this, shadow = new Path2D();
    shadows.push({ path: shadow }); // of what faces down: a convex body's whole shadow, once
    for (const face of faces) {
      const corners = face.corners.map((p) => place(pose, p)), normal = turn(pose.axes, face.normal);
      const middle = scale(corners.reduce(add), 1 / corners.length);
      const order = dot(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])), normal) < 0 ? [...corners].reverse() : corners;
      if (normal[2] < 0) shadow.addPath(this.polygon(this.shadowOf(order))); // one way round: no seams
      if (dot(normal, sub(camera.position, middle)) <= 0) continue;
      const path = this.polygon(corners), light = 0.66 + 0.5 * Math.max(0, dot(normal, camera.light));
      const color = css(shade(mix(theme.objectDark, theme.object, 0.75), light));
      this.put(camera.depth(middle), (ctx) => {
        ctx.fillStyle = color; ctx.fill(path);
        ctx.lineWidth = 0.7; ctx.strokeStyle = color; ctx.stroke(path);
      });
    }
  }

  /** A bar of round length at the target's depth, and the gripper's axes. */
  drawScale() {
    const { ctx, camera, theme } = this, s = camera.focal / camera.distance;
    const size = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002].find((v) => v * s <= Math.min(190, camera.width * 0.3)) || 0.001;
    const x = 78, y = camera.height - 20;
    ctx.strokeStyle = ctx.fillStyle = css(theme.text, 0.75);
    ctx.lineWidth = 2; ctx.lineCap = "butt"; ctx.beginPath();
    ctx.moveTo(x, y - 4); ctx.lineTo(x, y); ctx.lineTo(x + size * s, y); ctx.lineTo(x + size * s, y - 4); ctx.stroke();
    ctx.font = "12px system-ui, sans-serif"; ctx.textAlign = "center"; ctx.textBaseline = "alphabetic";
    ctx.fillText(`${Math.round(size * 1e4) / 10} mm`, x + size * s / 2, y - 7);
    const o = [36, camera.height - 36], arms = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((a, i) => ({
      x: dot(a, camera.right) * 24, y: -dot(a, camera.up) * 24, z: dot(a, camera.eye), name: "xyz"[i],
      color: [[222, 66, 66], [46, 158, 84], [58, 118, 232]][i],
    })).sort((a, b) => a.z - b.z);
    ctx.textBaseline = "middle";
    for (const arm of arms) {
      ctx.strokeStyle = ctx.fillStyle = css(arm.color); ctx.lineWidth = 2; ctx.beginPath();
      ctx.moveTo(...o); ctx.lineTo(o[0] + arm.x, o[1] + arm.y); ctx.stroke();
      if (Math.hypot(arm.x, arm.y) > 6) ctx.fillText(arm.name, o[0] + arm.x * 1.32, o[1] + arm.y * 1.32);
    }
    ctx.textBaseline = "alphabetic";
  }
}
