// SPDX-License-Identifier: Apache-2.0
// Pointer, touch, wheel, keyboard and buttons.

function bindControls({ scene, state, play, step, seek, look, setTheme, times }) {
  const get = (id) => document.getElementById(id), view = get("view"), camera = scene.camera;
  const pointers = new Map();

  function changed() { state.dirty = true; state.moved = true; camera.update(); }
  function pan(dx, dy) {
    const s = camera.focal / camera.distance;
    camera.target = along(along(camera.target, camera.right, -dx / s), camera.up, dy / s);
  }
  function zoom(factor) { camera.distance = Math.max(0.02, Math.min(20, camera.distance * factor)); }
  function turnBy(yaw, pitch) {
    camera.yaw += yaw; camera.pitch += pitch;
    for (const b of document.querySelectorAll("[data-camera]")) b.setAttribute("aria-current", "false");
    changed();
  }

  view.addEventListener("pointerdown", (e) => {
    view.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, { x: e.clientX, y: e.clientY, pan: e.button !== 0 || e.shiftKey });
    view.classList.add("dragging");
  });
  view.addEventListener("pointermove", (e) => {
    const held = pointers.get(e.pointerId);
    if (!held) return;
    const dx = e.clientX - held.x, dy = e.clientY - held.y;
    if (pointers.size === 2) {
      const other = [...pointers.entries()].find(([id]) => id !== e.pointerId)[1];
      const before = Math.hypot(held.x - other.x, held.y - other.y), after = Math.hypot(e.clientX - other.x, e.clientY - other.y);
      if (before > 0 && after > 0) zoom(before / after);
      pan(dx / 2, dy / 2); changed();
    } else if (held.pan) { pan(dx, dy); changed(); } else turnBy(-dx * 0.008, dy * 0.008);
    held.x = e.clientX; held.y = e.clientY;
  });
  for (const end of ["pointerup", "pointercancel"]) view.addEventListener(end, (e) => {
    pointers.delete(e.pointerId);
    if (!pointers.size) view.classList.remove("dragging");
  });
  view.addEventListener("contextmenu", (e) => e.preventDefault());
  view.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom(Math.exp(e.deltaY * (e.deltaMode ? 0.05 : 0.0012))); changed();
  }, { passive: false });
  view.addEventListener("dblclick", () => { state.moved = false; look("fit"); });

  for (const button of document.querySelectorAll("[data-camera]")) {
    button.addEventListener("click", () => { state.moved = false; look(button.dataset.camera); });
  }
  get("play").addEventListener("click", () => play(!state.playing));
  get("back").addEventListener("click", () => step(-1));
  get("next").addEventListener("click", () => step(1));
  get("scrub").addEventListener("input", (e) => { play(false); seek(times[Number(e.target.value)]); });
  get("speed").addEventListener("change", (e) => { state.speed = Number(e.target.value); });
  get("theme").addEventListener("click", () => setTheme(!document.documentElement.classList.contains("dark")));

  const second = Math.max(1, Math.round((times.length - 1) / Math.max(1e-9, times[times.length - 1] - times[0])));
  const keys = {
    " ": () => play(!state.playing), k: () => play(!state.playing),
    ArrowLeft: (e) => step(e.shiftKey ? -second : -1), ArrowRight: (e) => step(e.shiftKey ? second : 1),
    Home: () => step(-times.length), End: () => step(times.length),
    1: () => look("iso"), 2: () => look("front"), 3: () => look("side"), 4: () => look("top"), f: () => look("fit"),
    a: () => turnBy(-0.1, 0), d: () => turnBy(0.1, 0), w: () => turnBy(0, 0.1), s: () => turnBy(0, -0.1),
    "+": () => { zoom(0.9); changed(); }, "-": () => { zoom(1.1); changed(); },
  };
  window.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || e.target.tagName === "SELECT") return;
    if (e.key === " " && ["BUTTON", "INPUT"].includes(e.target.tagName) && e.target.id !== "scrub") return;
    const act = keys[e.key] || keys[e.key.toLowerCase()];
    if (act) { e.preventDefault(); act(e); }
  });
}
