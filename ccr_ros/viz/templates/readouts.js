// SPDX-License-Identifier: Apache-2.0
// The table of numbers beside the drawing, which is also the legend.

/** A short line in the colour and dashes of a curve. */
function swatch(color, dash) {
  const canvas = document.createElement("canvas");
  canvas.className = "swatch";
  canvas.width = 44; canvas.height = 18;
  const ctx = canvas.getContext("2d");
  ctx.scale(2, 2);
  ctx.strokeStyle = color; ctx.lineWidth = 3; ctx.setLineDash(dash);
  ctx.beginPath(); ctx.moveTo(0, 4.5); ctx.lineTo(22, 4.5); ctx.stroke();
  return canvas;
}

const plain = (v) => (v >= 1000 ? v.toFixed(0) : v >= 100 ? v.toFixed(1) : v.toFixed(2));

class Readouts {
  constructor(parent, data, unitText, colorOf, dashOf, toggle) {
    this.data = data;
    this.rows = [];
    parent.className = "card";
    const table = parent.appendChild(document.createElement("table"));
    const head = table.createTHead().insertRow();
    for (const text of ["Finger, cable", "Pull [mm]", `Tension [${unitText}]`, "State"]) {
      const cell = document.createElement("th");
      cell.scope = "col"; cell.textContent = text; head.append(cell);
    }
    const body = table.createTBody();
    data.fingers.forEach((finger, k) => {
      const row = body.insertRow(), name = row.insertCell(), button = document.createElement("button");
      row.className = "finger";
      button.type = "button"; button.className = "toggle"; button.textContent = finger.name;
      button.style.setProperty("--swatch", colorOf(k, 0));
      button.title = `${finger.name}: show or fade this finger`;
      button.setAttribute("aria-pressed", "true");
      button.addEventListener("click", () => button.setAttribute("aria-pressed", String(!toggle(finger.name))));
      name.append(button);
      const flags = row.insertCell();
      flags.colSpan = 3;
      const cables = finger.cables.map((cable, j) => {
        const line = body.insertRow(), label = line.insertCell();
        line.className = "cable"; label.title = cable;
        label.append(swatch(colorOf(k, j), dashOf(k, j)), document.createTextNode(cable));
        return { line, pull: line.insertCell(), tension: line.insertCell(), state: line.insertCell() };
      });
      this.rows.push({ finger, flags, cables });
    });
    this.unitText = unitText;
  }

  show(frame) {
    for (const { finger, flags, cables } of this.rows) {
      const now = frame.fingers[finger.name];
      flags.replaceChildren(...this.badges(now).map(([text, kind]) => {
        const badge = document.createElement("span");
        badge.className = `badge ${kind}`; badge.textContent = text;
        return badge;
      }));
      cables.forEach((cells, j) => {
        const taut = now && now.tensions[j] > 0, rest = finger.rest_lengths[j];
        const pull = now ? now.pulls[j] * 1e3 : 0;
        cells.pull.textContent = now ? pull.toFixed(2) + (rest ? ` (${(pull / rest / 10).toFixed(1)} %)` : "") : "–";
        cells.tension.textContent = now ? plain(now.tensions[j]) : "–";
        cells.state.textContent = now ? (taut ? "taut" : "slack") : "";
        cells.line.classList.toggle("slack", !taut);
      });
    }
  }

  badges(now) {
    if (!now) return [["nothing received yet", "warn"]];
    const out = [], count = now.contacts.length, total = now.contacts.reduce((sum, c) => sum + c.force, 0);
    if (count) out.push([`${count} contact${count > 1 ? "s" : ""}, ${plain(total)} ${this.unitText}`, "bad"]);
    if (!now.converged) out.push(["not converged", "bad"]);
    if (now.stale) out.push(["stale", "warn"]);
    if (!now.stable) out.push(["unstable", "warn"]);
    if (now.converged && now.stable && !now.stale) out.push(["converged, stable", "ok"]);
    return out;
  }
}
