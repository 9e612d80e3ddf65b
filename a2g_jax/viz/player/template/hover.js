// The tooltip with exact values, and the legend.

class Hover {
  constructor(timeline) {
    this.timeline = timeline;
    this.box = document.getElementById("tip");
    const lanes = document.getElementById("lanes");
    lanes.addEventListener("pointermove", (event) => this.show(event));
    for (const name of ["pointerleave", "pointercancel"]) lanes.addEventListener(name, () => this.hide());
    lanes.addEventListener("scroll", () => this.hide());
  }

  show(event) {
    const canvas = this.timeline.detail, box = canvas.getBoundingClientRect();
    const lines = this.timeline.tell(event.clientX - box.left, event.clientY - box.top);
    if (!lines) { this.hide(); return; }
    this.box.replaceChildren(...lines.filter(Boolean).map((line, i) => {
      const part = document.createElement(i ? "span" : "b");
      part.textContent = line;
      return part;
    }));
    this.box.hidden = false;
    const width = this.box.offsetWidth, height = this.box.offsetHeight;
    const left = clamp(event.clientX + 14, 6, window.innerWidth - width - 6), top = event.clientY - height - 12;
    this.box.style.transform = `translate(${left.toFixed(0)}px, ${(top < 6 ? event.clientY + 18 : top).toFixed(0)}px)`;
  }

  hide() { this.box.hidden = true; }
}

// The legend has only what is in the page's lanes.
function fillLegend(player) {
  const legend = document.getElementById("legend"), tracks = player.figures.flatMap((figure) => figure.tracks).filter((track) => kindOf(track) === "hands");
  legend.hidden = !tracks.length;
  if (!tracks.length) return;
  const item = (text, shape) => {
    const part = document.createElement("span");
    part.innerHTML = `<svg viewBox="0 0 20 12" aria-hidden="true"><path ${shape}/></svg>`;
    part.append(text);
    legend.append(part);
  };
  const phases = new Set(tracks.flatMap((track) => [...track.left, ...track.right].map((span) => span[2])));
  for (const [phase, [a, b]] of Object.entries(PHASES)) {
    if (!phases.has(phase)) continue;
    const solid = { stroke: 0.9, hold: 0.55, rest: 1 }[phase] || 0.35;
    item(phase, a + b > 0 ? `d="M0 12V${12 - 11 * a}L20 ${12 - 11 * b}V12z" opacity="${solid}"` : 'd="M0 11h20v1H0z"');
  }
  const keys = new Set(tracks.flatMap((track) => track.marks.map((mark) => mark[3]))), order = Object.keys(KEYS);
  if (keys.size) legend.append(Object.assign(document.createElement("em"), { textContent: "apex of a" }));
  for (const key of [...keys].sort((a, b) => order.indexOf(a) - order.indexOf(b) || (a < b ? -1 : 1)))
    item(key, `d="M10 .5l5.500 5.500-5.500 5.500-5.500-5.500z" fill="${keyColour(key)}"`);
}
