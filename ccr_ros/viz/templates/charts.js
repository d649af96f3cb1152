// SPDX-License-Identifier: Apache-2.0
// Curves over time with a cursor; a click or a drag moves the time.

/** Round steps for an axis: 1, 2 or 5 times a power of ten. */
function ticks(low, high, count) {
  const raw = (high - low) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.8);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-6; k++) out.push(k * step);
  return { values: out, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

class Chart {
  /** series: [{finger, color, dash, values: number or null per frame}]; marks: [{time, text}] of phases; named: whether to write them */
  constructor(parent, title, unitText, times, series, marks, named, seek) {
    Object.assign(this, { times, series, title, unitText, marks, named });
    const card = document.createElement("section"), head = document.createElement("h2"), note = document.createElement("span");
    const holder = document.createElement("div");
    card.className = "card chart";
    head.textContent = `${title} `;
    note.textContent = unitText;
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title} over time in ${unitText}, one curve per cable`);
    head.append(note); holder.append(this.canvas); card.append(head, holder); parent.append(card);
    this.still = document.createElement("canvas");
    const seekTo = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const share = (event.clientX - box.left - this.left) / (this.right - this.left);
      seek(this.t0 + Math.max(0, Math.min(1, share)) * (this.t1 - this.t0));
    };
    this.canvas.addEventListener("pointerdown", (e) => { this.canvas.setPointerCapture(e.pointerId); this.held = true; seekTo(e); });
    this.canvas.addEventListener("pointermove", (e) => { if (this.held) seekTo(e); });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => { this.held = false; });
    let low = 0, high = 0;
    for (const s of series) for (const v of s.values) if (v !== null) { low = Math.min(low, v); high = Math.max(high, v); }
    if (high - low < 1e-9) high = low + 1;
    this.low = low < 0 ? low - 0.06 * (high - low) : 0;
    this.high = high + 0.08 * (high - low);
    this.t0 = times[0];
    this.t1 = times.length > 1 ? times[times.length - 1] : times[0] + 1;
  }

  x(t) { return this.left + (t - this.t0) / (this.t1 - this.t0) * (this.right - this.left); }
  y(v) { return this.bottom - (v - this.low) / (this.high - this.low) * (this.bottom - this.top); }

  /** Paint what does not move with the cursor. */
  layout(theme, hidden) {
    const box = this.canvas.getBoundingClientRect(), ratio = Math.min(3, window.devicePixelRatio || 1);
    for (const c of [this.canvas, this.still]) { c.width = Math.max(1, Math.round(box.width * ratio)); c.height = Math.max(1, Math.round(box.height * ratio)); }
    Object.assign(this, { ratio, theme, hidden, top: this.named ? 17 : 6, bottom: box.height - 19, right: box.width - 10 });
    const ctx = this.still.getContext("2d");
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.font = "11px system-ui, -apple-system, 'Segoe UI', 'Liberation Sans', sans-serif";
    const rows = ticks(this.low, this.high, Math.max(3, (this.bottom - this.top) / 26));
    const labels = rows.values.map((v) => v.toFixed(rows.digits));
    // At least this wide, so that the cursors of all charts stand above each other.
    this.left = 10 + Math.max(24, ...labels.map((s) => ctx.measureText(s).width));
    const columns = ticks(this.t0, this.t1, Math.max(2, (this.right - this.left) / 62));
    ctx.lineWidth = 1; ctx.textBaseline = "middle"; ctx.textAlign = "right";
    rows.values.forEach((v, i) => {
      ctx.strokeStyle = css(theme.grid, Math.abs(v) < 1e-12 ? 1 : 0.55);
      ctx.beginPath(); ctx.moveTo(this.left, Math.round(this.y(v)) + 0.5); ctx.lineTo(this.right, Math.round(this.y(v)) + 0.5); ctx.stroke();
      ctx.fillStyle = css(theme.text, 0.68); ctx.fillText(labels[i], this.left - 5, this.y(v));
    });
    ctx.textBaseline = "top"; ctx.textAlign = "center";
    for (const t of columns.values) {
      ctx.strokeStyle = css(theme.grid, 0.4);
      ctx.beginPath(); ctx.moveTo(this.x(t), this.top); ctx.lineTo(this.x(t), this.bottom); ctx.stroke();
      const edge = this.x(t) > this.right - 14;
      ctx.textAlign = edge ? "right" : "center";
      ctx.fillText(`${t.toFixed(columns.digits)} s`, edge ? this.right + 8 : this.x(t), this.bottom + 5);
    }
    ctx.textAlign = "left"; ctx.textBaseline = "top"; ctx.setLineDash([3, 3]);
    this.marks.forEach(({ time, text }, i) => {
      const x = Math.round(this.x(time)) + 0.5, next = this.marks[i + 1];
      ctx.strokeStyle = css(theme.text, 0.35);
      if (i) { ctx.beginPath(); ctx.moveTo(x, this.top); ctx.lineTo(x, this.bottom); ctx.stroke(); }
      const room = this.x(next ? next.time : this.t1) - x;
      ctx.fillStyle = css(theme.text, 0.6);
      if (this.named && ctx.measureText(text).width + 6 < room) ctx.fillText(text, x + 3, this.top - 15);
    });
    ctx.setLineDash([]);
    // Curves of several fingers often coincide: the first drawn are the widest, so that all show.
    const shown = this.series.filter((s) => !hidden.has(s.finger));
    const fingers = [...new Set(shown.map((s) => s.finger))];
    shown.forEach((s) => {
      ctx.lineWidth = 1.4 + (fingers.length <= 4 ? 2.1 * (fingers.length - 1 - fingers.indexOf(s.finger)) : 0);
      ctx.strokeStyle = s.color; ctx.setLineDash(s.dash); ctx.lineJoin = "round";
      ctx.beginPath();
      let open = false;
      s.values.forEach((v, k) => {
        if (v === null) { open = false; return; }
        if (open) ctx.lineTo(this.x(this.times[k]), this.y(v)); else ctx.moveTo(this.x(this.times[k]), this.y(v));
        open = true;
      });
      ctx.stroke();
    });
    ctx.setLineDash([]);
  }

  cursor(time, index) {
    const ctx = this.canvas.getContext("2d");
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, this.canvas.width, this.canvas.height);
    ctx.drawImage(this.still, 0, 0);
    ctx.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const x = this.x(time);
    ctx.strokeStyle = css(this.theme.text, 0.7); ctx.lineWidth = 1.2;
    ctx.beginPath(); ctx.moveTo(x, this.top - 3); ctx.lineTo(x, this.bottom); ctx.stroke();
    for (const s of this.series) {
      const v = s.values[index];
      if (v === null || this.hidden.has(s.finger)) continue;
      ctx.beginPath(); ctx.arc(x, this.y(v), 3.4, 0, 7); ctx.fillStyle = s.color; ctx.fill();
      ctx.lineWidth = 1.2; ctx.strokeStyle = css(this.theme.panel); ctx.stroke();
    }
  }
}
