// SPDX-License-Identifier: Apache-2.0
// Ties the parts together: time, transport, pointer, keyboard, theme, the address' fragment.

const $ = (id) => document.getElementById(id);
const data = JSON.parse($("recording").textContent);
const style = JSON.parse($("style").textContent);
const times = data.frames.map((f) => f.time), duration = times[times.length - 1];
const unitText = data.forces_are === "newton" ? "N" : "1/m² per EI";
const hidden = new Set();
const state = { time: 0, playing: false, speed: 1, camera: "iso", dirty: true, layout: true };

/** One hue per finger (per cable if there is one finger); further cables lighter, and dashed. */
function colorOf(finger, cable) {
  const hue = rgb(style.palette[(data.fingers.length > 1 ? finger : cable) % style.palette.length]);
  if (data.fingers.length === 1 || cable === 0) return hex(hue);
  return hex(cable % 2 ? mix(hue, WHITE, 0.38) : mix(hue, BLACK, 0.3));
}
const hex = (c) => "#" + c.map((v) => Math.round(v).toString(16).padStart(2, "0")).join("");
const dashOf = (finger, cable) => (data.fingers.length > 1 ? [[], [7, 4], [2, 3], [9, 3, 2, 3]][cable % 4] : []);

const series = (value) => data.fingers.flatMap((finger, k) => finger.cables.map((cable, j) => ({
  finger: finger.name, color: colorOf(k, j), dash: dashOf(k, j),
  values: data.frames.map((frame) => (frame.fingers[finger.name] ? value(frame.fingers[finger.name], j) : null)),
})));
const seek = (t) => { state.time = Math.max(times[0], Math.min(duration, t)); state.dirty = true; };

const phaseOf = (frame) => frame.phase || "";
const marks = [];
for (const frame of data.frames) {
  if (phaseOf(frame) !== (marks.length ? marks[marks.length - 1].text : "")) marks.push({ time: frame.time, text: phaseOf(frame) });
}
const addChart = (title, unit, curves) => charts.push(new Chart($("charts"), title, unit, times, curves, marks, marks.length > 1 && !charts.length, seek));

const charts = [];
const scene = new Scene($("view"), data, colorOf);
addChart("Cable tension", unitText, series((f, j) => f.tensions[j]));
if (scene.maxForce > 0) {
  const force = (f) => f.contacts.reduce((sum, c) => sum + c.force, 0);
  addChart("Contact force", `${unitText}, sum per finger`, data.fingers.map((finger, k) => ({
    finger: finger.name, color: colorOf(k, 0), dash: [],
    values: data.frames.map((frame) => (frame.fingers[finger.name] ? force(frame.fingers[finger.name]) : null)),
  })));
}
if (data.frames.some((frame) => frame.grip && frame.grip.held)) {
  const margin = (frame, name) => {
    const own = frame.grip && frame.grip.held ? frame.grip.contacts.filter((c) => c.finger === name && c.margin !== null).map((c) => c.margin) : [];
    return own.length ? Math.min(...own) : null;
  };
  addChart("Friction margin", "while carried; slips at 0", data.fingers.map((finger, k) => ({
    finger: finger.name, color: colorOf(k, 0), dash: [], values: data.frames.map((frame) => margin(frame, finger.name)),
  })));
}
const turns = data.objects.map((object) => {
  const first = data.frames.find((frame) => frame.objects && frame.objects[object.name]);
  return { name: object.name, values: data.frames.map((frame) => {
    const now = frame.objects && frame.objects[object.name];
    return now ? headingSince(first.objects[object.name].orientation, now.orientation) : null;
  }) };
}).filter((turn) => turn.values.some((v) => Math.abs(v) > 1));
if (turns.length) {
  addChart("Turn about z", `° of ${turns.map((turn) => turn.name).join(", ")}`, turns.map((turn, k) => ({
    finger: "", color: style.object, dash: dashOf(0, k), values: turn.values,
  })));
}
addChart("Cable pull", "mm", series((f, j) => f.pulls[j] * 1e3));
if (data.frames.some((frame) => Object.values(frame.fingers).some((f) => f.servo_angles))) {
  addChart("Servo angle", "°", series((f, j) => (f.servo_angles ? f.servo_angles[j] * 180 / Math.PI : null)));
}
const readouts = new Readouts($("readouts"), data, unitText, colorOf, dashOf, (name) => {
  if (!hidden.delete(name)) hidden.add(name);
  state.layout = true;
  return hidden.has(name);
});

/** Index of the last frame not later than t. */
function indexAt(t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + 1e-9) low = middle; else high = middle - 1;
  }
  return low;
}

function describe() {
  const rate = times.length > 1 ? `${((times.length - 1) / (duration - times[0])).toFixed(0)} frames/s` : "one frame";
  const count = data.fingers.length;
  $("name").textContent = data.gripper;
  $("facts").textContent = [`${count} finger${count === 1 ? "" : "s"}`, `${duration.toFixed(1)} s`, rate,
    ...data.objects.map((o) => `${o.name} (${o.kind})`)].join(" · ");
  $("scrub").max = String(times.length - 1);
  const slack = data.frames.some((f) => Object.values(f.fingers).some((g) => g.tensions.some((t) => t <= 0)));
  const entries = [["cable, wider = more tension", colorOf(0, 0), []]];
  if (slack) entries.push(["slack cable", "#8a94a3", [4, 3.5]]);
  if (scene.maxForce > 0) entries.push([`contact, force on the finger (longest: ${plain(scene.maxForce)} ${unitText})`, style.contact, []]);
  if (data.frames.some((frame) => frame.grip && frame.grip.contacts.some((c) => c.margin !== null))) {
    entries.push(["friction on the finger, on the same scale", style.friction, []]);
  }
  for (const [text, color, dash] of entries) {
    const item = document.createElement("li");
    item.append(swatch(color, dash), text);
    $("key").append(item);
  }
}

/** Bands under the scrub bar: contact, and where the solver did not converge or the pose was stale. */
function drawBands() {
  const canvas = $("bands"), ctx = canvas.getContext("2d"), box = canvas.getBoundingClientRect();
  canvas.width = Math.max(1, Math.round(box.width * 2)); canvas.height = 16;
  ctx.fillStyle = css(scene.theme.grid, 0.9); ctx.fillRect(0, 0, canvas.width, 16);
  const span = canvas.width / Math.max(1, times.length - 1);
  data.frames.forEach((frame, i) => {
    const now = Object.values(frame.fingers);
    const bad = now.some((f) => !f.converged), touch = now.filter((f) => f.contacts.length).length / data.fingers.length;
    const color = bad ? css(scene.theme.text, 0.9) : touch ? css(scene.theme.contact, 0.3 + 0.6 * touch) : "";
    if (color) { ctx.fillStyle = color; ctx.fillRect((i - 0.5) * span, 0, span + 0.6, 16); }
  });
}

function paint() {
  if (state.layout) {
    scene.useTheme(); scene.resize();
    if (!state.fitted) { scene.fit(); state.fitted = true; }
    for (const chart of charts) chart.layout(scene.theme, hidden);
    drawBands();
    state.layout = false;
  }
  const i = indexAt(state.time), gap = (times[i + 1] ?? times[i]) - times[i];
  scene.draw(i, state.playing && gap > 0 ? Math.min(1, (state.time - times[i]) / gap) : 0, hidden);
  for (const chart of charts) chart.cursor(state.playing ? state.time : times[i], i);
  if (state.shown !== i) {
    state.shown = i;
    readouts.show(data.frames[i]);
    $("scrub").value = String(i);
    $("scrub").setAttribute("aria-valuetext", `${times[i].toFixed(2)} seconds`);
    const phase = phaseOf(data.frames[i]);
    $("clock").textContent = `${times[i].toFixed(2)} s${phase ? ` · ${phase}` : ""}`;
    const now = document.createElement("b"), of = document.createElement("span");
    now.textContent = times[i].toFixed(2); of.textContent = ` / ${duration.toFixed(2)} s`;
    $("time").replaceChildren(now, of);
    const touching = data.fingers.filter((f) => data.frames[i].fingers[f.name]?.contacts.length).map((f) => f.name);
    $("view").setAttribute("aria-label", `${data.gripper} at ${times[i].toFixed(2)} s${phase ? `, ${phase}` : ""}; ${touching.length ? `in contact: ${touching.join(", ")}` : "no contact"}`);
  }
}

let last = 0;
function tick(now) {
  const passed = Math.min(0.1, (now - last) / 1000);
  last = now;
  if (state.playing) {
    state.time += passed * state.speed;
    if (state.time >= duration) {
      if ($("loop").checked && duration > times[0]) state.time = times[0]; else { state.time = duration; play(false); }
    }
    state.dirty = true;
  }
  if (state.dirty || state.layout) { state.dirty = false; paint(); }
  requestAnimationFrame(tick);
}

function play(on) {
  if (on && state.time >= duration) state.time = times[0];
  if (!on && state.playing) state.time = times[indexAt(state.time)];
  state.playing = on; state.dirty = true;
  $("play-shape").setAttribute("d", on ? "M6 4h4.500v16H6zM13.500 4H18v16h-4.500z" : "M7 4v16l13-8z");
  $("play").setAttribute("aria-label", on ? "Pause" : "Play");
}
function step(frames) { play(false); seek(times[Math.max(0, Math.min(times.length - 1, indexAt(state.time) + frames))]); }

function look(name) {
  if (name !== "fit") {
    scene.camera.preset(name);
    for (const b of document.querySelectorAll("[data-camera]")) b.setAttribute("aria-current", String(b.dataset.camera === name));
  }
  scene.fit(); state.dirty = true;
}

function setTheme(dark) { document.documentElement.classList.toggle("dark", dark); state.layout = true; state.shown = -1; }

function readFragment() {
  const wanted = new URLSearchParams(location.hash.slice(1)), t = parseFloat(wanted.get("t"));
  if (Number.isFinite(t)) { play(false); seek(t); }
  if (["light", "dark"].includes(wanted.get("theme"))) setTheme(wanted.get("theme") === "dark");
  if (["iso", "front", "side", "top"].includes(wanted.get("view"))) look(wanted.get("view"));
  if (wanted.has("play")) play(true);
}

const prefers = window.matchMedia("(prefers-color-scheme: dark)");
setTheme(prefers.matches);
prefers.addEventListener("change", (e) => setTheme(e.matches));
scene.useTheme(); scene.resize();
describe();
look("iso");
bindControls({ scene, state, play, step, seek, look, setTheme, times });
window.addEventListener("hashchange", readFragment);
readFragment();
// Painting at once, before the browser shows the new size, keeps a stretched picture from flashing.
const resized = new ResizeObserver(() => { state.layout = true; state.fitted = state.moved; paint(); });
for (const id of ["stage", "charts", "track"]) resized.observe($(id));
requestAnimationFrame(tick);
