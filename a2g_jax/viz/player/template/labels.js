// Labels of the figures: their names, the phases of their hands, and links to their files.

class Labels {
  constructor(player) {
    this.player = player;
    this.buttons = player.figures.map((figure) => this.button(figure));
    player.element("labels").append(...this.buttons);
    for (const figure of player.figures.filter(({ files }) => files.length)) player.element("files").append(this.links(figure));
  }

  button(figure) {
    const { player } = this;
    const label = document.createElement("button"), name = document.createElement("b"), note = document.createElement("span");
    name.textContent = figure.label; note.textContent = figure.note;
    label.append(name, ...(figure.note ? [note] : []));
    if (doing(figure, 0)) {
      label.doing = ["left", "right"].map(() => document.createElement("i"));
      const both = document.createElement("span");
      both.className = "doing";
      both.append(...label.doing);
      label.append(both);
    }
    label.style.setProperty("--own", figure.colour);
    label.title = `Show ${figure.label} alone, or all again${figure.index < 9 ? ` (${figure.index + 1}, 0)` : ""}`;
    label.addEventListener("click", () => player.solo(player.only === figure.index ? null : figure.index));
    return label;
  }

  // Links to the files beside the page, after the figure's name.
  links(figure) {
    const group = document.createElement("span");
    group.append(figure.label);
    for (const name of figure.files) {
      const link = document.createElement("a");
      link.href = encodeURI(name);
      link.download = name;
      link.textContent = name.split(".").pop().toUpperCase();
      link.title = `Download ${name}`;
      group.append(link);
    }
    return group;
  }

  // In the overlay, labels are a legend at the top.
  get legend() { return this.player.overlay && this.player.shown().length > 1; }

  // Columns of the legend, pixels.
  step(width) { return Math.min(150, (width - 24) / this.buttons.length); }

  // Otherwise they stand under the feet.
  place(width) {
    const { legend } = this, step = this.step(width);
    for (const band of this.player.bands) band.members.forEach((index, k) => {
      const label = this.buttons[index], { style } = label;
      if (legend) { style.transform = `translate(${Math.round(12 + k * step)}px, ${width < 640 ? 52 : 62}px)`; return; }
      const room = band.members.length > 1 ? clamp(band.metre * band.spacing - 4, 56, 280) : Math.min(width - 20, 400);
      if (label.room !== room) {
        style.maxWidth = `${room}px`;
        Object.assign(label, { room, wide: label.offsetWidth, tall: label.offsetHeight });
      }
      const [x, y] = onScreen(band, [band.slots[k][0], 0, 0.22 * band.frame.tall / 1.7]);
      const left = clamp(x - label.wide / 2, 4, width - label.wide - 4), top = clamp(y + 6, band.y + 4, band.y + band.height - label.tall - 6);
      style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
    });
  }

  // After the arrangement changed: which labels there are, and their sizes anew.
  reset(width) {
    const { legend } = this;
    this.buttons.forEach((label, index) => {
      label.hidden = !this.player.bands.some((band) => band.members.includes(index));
      label.room = null;
      label.style.maxWidth = legend ? `${this.step(width) - 4}px` : "";
    });
  }

  // Under each figure, the phases of its hands.
  showDoing() {
    for (const figure of this.player.shown()) {
      const label = this.buttons[figure.index];
      if (label.doing) doing(figure, this.player.now).forEach(({ hand, phase, key }, k) => {
        const text = `${hand[0].toUpperCase()} ${key || SHORT[phase] || phase}`, part = label.doing[k];
        if (part.textContent === text) return;
        part.textContent = text;
        part.title = `${hand} hand: ${phase}${key ? `, ${key}` : ""}`;
        part.className = phase;
        part.style.background = key ? keyColour(key) : "";
      });
    }
  }
}
