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

/** By how much an object has turned about z [degree] since another orientation: the twist of the turn between. */
function headingSince(then, now) {
  const [ax, ay, az, aw] = then, [bx, by, bz, bw] = now; // now times the inverse of then; its z and w
  const z = bz * aw - bw * az - bx * ay + by * ax, w = bw * aw + bx * ax + by * ay + bz * az;
  const angle = 2 * Math.atan2(z, w);
  return (angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI))) * 180 / Math.PI;
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
    faces.push(...patch(corner, u, v, normal, 6));
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
  return faces;
}

function capsuleFaces([span, radius]) {
  const faces = [], rings = 6, levels = 6, rows = [];
  const ring = (a, z) => rows.push([radius * Math.cos(a), z + radius * Math.sin(a), a]);
  for (let k = -rings; k <= 0; k++) ring(k * Math.PI / 2 / rings, -span / 2);
  for (let k = 1; k < levels; k++) ring(0, -span / 2 + span * k / levels);
  for (let k = 0; k <= rings; k++) ring(k * Math.PI / 2 / rings, span / 2);
  const at = ([r, z], i) => [r * CIRCLE[i % RIM][0], r * CIRCLE[i % RIM][1], z];
  for (let k = 0; k + 1 < rows.length; k++) for (let i = 0; i < RIM; i++) {
    const turn = (i + 0.5) * 2 * Math.PI / RIM, rise = (rows[k][2] + rows[k + 1][2]) / 2;
    const normal = [Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise)];
    faces.push({ corners: [at(rows[k], i), at(rows[k], i + 1), at(rows[k + 1], i + 1), at(rows[k + 1], i)], normal });
  }
  return faces;
}

const meshes = new WeakMap(); // by the array of vertices, which stays while the body moves

/** Triangles of a mesh, long ones cut up so that they sort well against what is near them. */
function meshFaces({ vertices, faces }) {
  if (meshes.has(vertices)) return meshes.get(vertices);
  const spans = [0, 1, 2].map((i) => Math.max(...vertices.map((v) => v[i])) - Math.min(...vertices.map((v) => v[i])));
  const longest = Math.max(...spans) / 5, out = [];
  const cut = (corners, normal) => {
    const sides = corners.map((p, i) => length(sub(corners[(i + 1) % 3], p))), i = sides.indexOf(Math.max(...sides));
    if (sides[i] <= longest) { out.push({ corners, normal }); return; }
    const [a, b, c] = [0, 1, 2].map((k) => corners[(i + k) % 3]), middle = mix(a, b, 0.5);
    cut([a, middle, c], normal);
    cut([middle, b, c], normal);
  };
  for (const face of faces) {
    const corners = face.map((k) => vertices[k]);
    cut(corners, unit(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))));
  }
  meshes.set(vertices, out);
  return out;
}

const facesOf = (body) => (body.kind === "mesh" ? meshFaces(body)
  : { box: boxFaces, cylinder: cylinderFaces, capsule: capsuleFaces }[body.kind](body.dimensions));

/** Radius of a ball about a body's position that holds it. */
function reachOf(body) {
  if (body.kind === "mesh") return Math.max(...body.vertices.map(length));
  if (body.kind === "sphere") return body.dimensions[0];
  if (body.kind === "capsule") return body.dimensions[0] / 2 + body.dimensions[1];
  return 0.5 * Math.hypot(...body.dimensions);
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
