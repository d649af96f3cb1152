// SPDX-License-Identifier: Apache-2.0
// Shapes of objects and of the base plate, and small questions about a recording.

const poseOfBase = (finger) => poseOf(finger.base);

function maxOf(data, values) {
  let most = 0;
  for (const frame of data.frames) for (const f of Object.values(frame.fingers)) for (const v of values(f)) most = Math.max(most, v);
  return most;
}

/** Objects present in a frame, at their poses there. */
function objectsAt(data, frame) {
  if (!frame.objects) return data.objects;
  return data.objects.filter((o) => frame.objects[o.name]).map((o) => ({ ...o, ...frame.objects[o.name] }));
}

/** Poses of a finger part of the way between two frames; all else is the earlier frame's. */
function between(now, then, t) {
  if (now.backbone.length !== then.backbone.length) return now;
  const rows = (a, b) => (b && a.length === b.length ? a.map((p, i) => mix(p, b[i], t)) : a);
  const cables = {};
  for (const [name, path] of Object.entries(now.cables)) cables[name] = rows(path, then.cables[name]);
  return {
    ...now, cables, backbone: rows(now.backbone, then.backbone),
    orientations: now.orientations.map((q, i) => blend(q, then.orientations[i], t)),
  };
}

/** A round plate under the lowest finger base, wide enough to carry all bases. */
function plateOf(fingers, bases) {
  const center = scale(bases.map((b) => b.origin).reduce(add), 1 / bases.length);
  center[2] = Math.min(...bases.map((b) => b.origin[2]));
  const radius = Math.max(...bases.map((b, i) => Math.hypot(b.origin[0] - center[0], b.origin[1] - center[1]) + 2.2 * fingers[i].disk_radius));
  return { center, radius };
}

/** A patch of quads over a parallelogram; small ones sort well against what is near them. */
function patch(origin, u, v, normal, count) {
  const faces = [];
  for (let i = 0; i < count; i++) for (let j = 0; j < count; j++) {
    const at = (a, b) => along(along(origin, u, a / count), v, b / count);
    faces.push({ corners: [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], normal });
  }
  return faces;
}

function boxFaces([x, y, z]) {
  const size = [x, y, z], faces = [];
  for (let axis = 0; axis < 3; axis++) for (const sign of [-1, 1]) {
    const normal = [0, 0, 0], u = [0, 0, 0], v = [0, 0, 0], a = (axis + 1) % 3, b = (axis + 2) % 3;
    normal[axis] = sign; u[a] = size[a]; v[b] = size[b];
    const corner = sub(scale(size, -0.5), [0, 0, 0]);
    corner[axis] = sign * size[axis] / 2;
    const quads = patch(corner, u, v, normal, 6);
    if (axis === 2) quads[0].shadow = [corner, add(corner, u), add(add(corner, u), v), add(corner, v)];
    faces.push(...quads);
  }
  return faces;
}

function cylinderFaces([height, radius]) {
  const faces = [], levels = 8, at = (i, z) => [radius * CIRCLE[i % RIM][0], radius * CIRCLE[i % RIM][1], z];
  for (let i = 0; i < RIM; i++) {
    const middle = (i + 0.5) * 2 * Math.PI / RIM, normal = [Math.cos(middle), Math.sin(middle), 0];
    for (let k = 0; k < levels; k++) {
      const low = -height / 2 + height * k / levels, high = low + height / levels;
      faces.push({ corners: [at(i, low), at(i + 1, low), at(i + 1, high), at(i, high)], normal });
    }
    for (const sign of [-1, 1]) {
      const z = sign * height / 2;
      faces.push({ corners: [[0, 0, z], at(i, z), at(i + 1, z)], normal: [0, 0, sign] });
    }
  }
  faces[0].shadow = CIRCLE.map((_, i) => at(i, -height / 2));
  return faces;
}

/** Circles of latitude and longitude, so that a turning ball is seen to turn. */
function sphereRings(pose, radius) {
  const rings = [], ring = (f) => Array.from({ length: 73 }, (_, i) => place(pose, scale(f(i * Math.PI / 36), radius)));
  for (let k = 0; k < 6; k++) {
    const a = k * Math.PI / 6;
    rings.push(ring((t) => [Math.cos(a) * Math.cos(t), Math.sin(a) * Math.cos(t), Math.sin(t)]));
  }
  for (const lat of [-60, -30, 0, 30, 60]) {
    const c = Math.cos(lat * Math.PI / 180), s = Math.sin(lat * Math.PI / 180);
    rings.push(ring((t) => [c * Math.cos(t), c * Math.sin(t), s]));
  }
  return rings;
}
