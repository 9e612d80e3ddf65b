// The player: one clock (the audio), one camera, all figures.

class Player {
  constructor(data, positions, meshes, speech) {
    this.element = (id) => document.getElementById(id);
    this.figures = data.figures.map((figure, index) => new Figure(figure, positions[index], index, meshes[figure.mesh]));
    this.words = data.words;
    this.lanes = data.lanes;
    this.speech = speech;
    this.duration = Math.max(data.duration, 1e-3);
    this.fastest = Math.max(0.5, ...this.figures.map((figure) => figure.speeds.reduce((a, b) => Math.max(a, b), 0)));
    this.camera = { ...START };
    this.now = 0;
    this.playing = false;
    this.rate = 1;
    this.only = null;
    this.overlay = this.trails = this.loop = false;
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.renderer = makeRenderer(this.element("view"), location.hash !== "#2d");
    this.timeline = new Timeline(this);
    this.audio = this.loadAudio(speech);
    this.makeLabels();
    this.makeFiles();
    fillLegend(this);
    this.makeControls();
    attachCamera(this.element("view"), this);
    attachKeys(this);
    this.scheme.addEventListener("change", () => { this.timeline.style(); this.wake(); });
    new ResizeObserver(() => { this.stale = true; this.wake(); }).observe(this.element("stage"));
    new ResizeObserver(() => this.wake()).observe(this.element("panel"));
    this.stale = true;
    this.pictures = 0;
    this.clock = performance.now();
    this.ready = new Promise((done) => { this.opened = done; });
    this.wake();
  }

  loadAudio(speech) {
    const audio = this.element("audio");
    if (!speech) return null;
    this.timeline.load(speech.samples, speech.rate);
    audio.src = URL.createObjectURL(new Blob([speech.wav], { type: "audio/wav" }));
    audio.addEventListener("ended", () => this.ended());
    return audio;
  }

  // --- time ---

  play() {
    if (this.now >= this.duration - 1e-3) this.seek(0);
    this.playing = true;
    this.clock = performance.now();
    this.paint();
    if (!this.audio) return Promise.resolve();
    this.audio.playbackRate = this.rate;
    return this.audio.play().catch((error) => {
      // A pause right after play is no failure; a browser that refuses sound stops the player.
      if (error.name !== "AbortError") this.pause();
    });
  }

  pause() {
    this.playing = false;
    if (this.audio) { this.audio.pause(); if (!this.audio.seeking) this.now = clamp(this.now, 0, this.duration); }
    this.paint();
  }

  toggle() { return this.playing ? this.pause() : this.play(); }

  seek(time) {
    this.now = clamp(Number(time) || 0, 0, this.duration);
    if (this.audio) this.audio.currentTime = Math.min(this.now, Number.isFinite(this.audio.duration) ? this.audio.duration : this.now);
    this.paint();
  }

  step(frames) {
    this.pause();
    const { fps } = this.shown()[0];
    this.seek((Math.round(this.now * fps) + frames) / fps);
  }

  ended() {
    if (!this.playing) return;
    if (this.loop) { this.now = 0; if (this.audio) { this.audio.currentTime = 0; this.audio.play().catch(() => this.pause()); } return; }
    this.playing = false;
    this.now = this.duration;
    this.paint();
  }

  // The audio is the master. Its clock moves in steps, so follow it with our own and steer that towards it.
  advance(stamp) {
    const elapsed = Math.min((stamp - this.clock) / 1000, 0.25);
    this.clock = stamp;
    if (!this.playing) return;
    if (!this.audio) {
      this.now += elapsed * this.rate;
      if (this.now >= this.duration) this.ended();
      return;
    }
    if (this.audio.seeking || this.audio.readyState < 2) return;
    const played = this.audio.currentTime, guess = this.now + (this.audio.paused ? 0 : elapsed * this.rate), off = played - guess;
    this.now = clamp(Math.abs(off) > 0.12 * Math.max(1, this.rate) ? played : guess + 0.15 * off, 0, this.duration);
  }

  // --- picture ---

  shown() { return this.only === null ? this.figures : [this.figures[this.only]]; }

  wake() {
    if (this.pending) return;
    this.pending = requestAnimationFrame((stamp) => {
      this.pending = 0;
      this.advance(stamp);
      this.draw(stamp, false);
      if (this.playing) this.wake(); else this.settle();
    });
  }

  // A picture that stays a while is drawn again at full quality, where the moving one is simpler.
  settle() {
    clearTimeout(this.settling);
    if (this.renderer.software || this.renderer.scale < 1) this.settling = setTimeout(() => { if (!this.playing) this.draw(performance.now(), true); }, 200);
  }

  paint() {
    this.element("play").classList.toggle("playing", this.playing);
    this.element("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.wake();
  }

  draw(stamp, still) {
    const stage = this.element("stage"), width = stage.clientWidth, height = stage.clientHeight;
    if (width < 2 || height < 2) return;
    if (this.stale) {
      this.bands = arrange(this.figures, this.shown().map((figure) => figure.index), this.overlay && this.shown().length > 1, width, height);
      this.stale = false;
      this.resetLabels(width);
    }
    const theme = THEMES[this.scheme.matches ? "dark" : "light"];
    for (const band of this.bands) {
      placeCamera(band, this.camera);
      band.figures = band.members.map((index, k) => {
        const figure = this.figures[index];
        figure.update(this.now, this.camera.yaw, band.slots[k], theme, this.trails);
        return figure.drawn;
      });
    }
    const ratio = Math.min(window.devicePixelRatio || 1, 2), moving = this.renderer.scale;
    if (still) this.renderer.scale = this.renderer.software && ratio < 2 ? 2 : 1;
    this.renderer.render({ bands: this.bands, width, height, ratio, theme, yaw: this.camera.yaw, overlay: this.overlay, still });
    this.renderer.scale = moving;
    this.pictures += 1;
    this.placeLabels(width, height);
    this.timeline.draw();
    this.showClock();
    this.showDoing();
    this.adapt(stamp);
    if (this.opened) { this.opened(true); this.opened = null; }
  }

  // Slow machines show fewer pictures while playing, and below 12 a second get fewer pixels.
  adapt(stamp) {
    const took = stamp - (this.stamp || stamp);
    this.stamp = stamp;
    if (!this.playing) { this.slow = this.since = 0; return; }
    if (took <= 0) return;
    this.slow = mix(this.slow || 16, Math.min(took, 400), 0.15);
    this.since += 1;
    if (this.slow > 80 && this.since > 8 && this.renderer.scale > 0.52) { this.renderer.scale *= 0.85; this.since = 0; }
  }

  showClock() {
    const say = (time) => `${Math.floor(time / 60)}:${(time % 60).toFixed(1).padStart(4, "0")}`;
    const text = say(Math.floor(this.now * 10) / 10), total = say(Math.floor(this.duration * 10) / 10);
    if (text === this.said) return;
    this.said = text;
    const now = document.createElement("b");
    now.textContent = text;
    this.element("clock").replaceChildren(now, ` / ${total}`);
    const slider = this.element("scrubber");
    slider.setAttribute("aria-valuemax", this.duration.toFixed(1));
    slider.setAttribute("aria-valuenow", this.now.toFixed(1));
    slider.setAttribute("aria-valuetext", `${text} of ${total}`);
  }

  makeLabels() {
    this.labels = this.figures.map((figure) => {
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
      label.addEventListener("click", () => this.solo(this.only === figure.index ? null : figure.index));
      this.element("labels").append(label);
      return label;
    });
  }

  // Links to the files beside the page, those of each figure after its name.
  makeFiles() {
    for (const figure of this.figures.filter(({ files }) => files.length)) {
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
      this.element("files").append(group);
    }
  }

  // Labels stand under the feet; in the overlay they are a legend at the top.
  placeLabels(width) {
    const legend = this.overlay && this.shown().length > 1, step = Math.min(150, (width - 24) / this.labels.length);
    for (const band of this.bands) band.members.forEach((index, k) => {
      const label = this.labels[index], { style } = label;
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

  // Under each figure, the phases of its hands.
  showDoing() {
    for (const figure of this.shown()) {
      const label = this.labels[figure.index];
      if (label.doing) doing(figure, this.now).forEach(({ hand, phase, key }, k) => {
        const text = `${hand[0].toUpperCase()} ${key || SHORT[phase] || phase}`, part = label.doing[k];
        if (part.textContent === text) return;
        part.textContent = text;
        part.title = `${hand} hand: ${phase}${key ? `, ${key}` : ""}`;
        part.className = phase;
        part.style.background = key ? keyColour(key) : "";
      });
    }
  }

  // After the arrangement changed: which labels there are, and their sizes anew.
  resetLabels(width) {
    const legend = this.overlay && this.shown().length > 1;
    this.labels.forEach((label, index) => {
      label.hidden = !this.bands.some((band) => band.members.includes(index));
      label.room = null;
      label.style.maxWidth = legend ? `${Math.min(150, (width - 24) / this.labels.length) - 4}px` : "";
    });
  }

  // --- choices ---

  solo(index) {
    if (index !== null && !this.figures[index]) return;
    this.only = index;
    this.stale = true;
    this.wake();
  }

  view(change) {
    Object.assign(this.camera, change);
    this.wake();
  }

  makeControls() {
    const press = (id, apply) => {
      const button = this.element(id);
      button.addEventListener("click", () => {
        const on = button.getAttribute("aria-pressed") !== "true";
        button.setAttribute("aria-pressed", on);
        apply(on);
        this.wake();
      });
    };
    this.element("play").addEventListener("click", () => this.toggle());
    press("loop", (on) => { this.loop = on; });
    press("overlay", (on) => { this.overlay = on; this.stale = true; });
    press("trails", (on) => { this.trails = on; });
    press("mute", (on) => { this.element("audio").muted = on; });
    if (this.figures.length < 2) this.element("overlay").hidden = true;
    if (!this.audio) this.element("mute").hidden = this.element("volume").hidden = true;
    this.element("volume").addEventListener("input", (event) => { this.element("audio").volume = Number(event.target.value); });
    this.element("rate").addEventListener("change", (event) => {
      this.rate = Number(event.target.value);
      this.element("audio").playbackRate = this.rate;
    });
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => this.view(VIEWS[button.dataset.view]));
  }
}

async function open(data) {
  const unpacked = Promise.all(data.figures.map(unpackPositions)), meshes = Promise.all(data.meshes.map(unpackMesh));
  const speech = await unpackSpeech(data.audio).catch((error) => {
    console.warn("This browser cannot decode the speech; the figures move without it:", error.message);
    return null;
  });
  return new Player(data, await unpacked, await meshes, speech);
}

let player = null;
const opening = open(JSON.parse(document.getElementById("data").textContent)).then((made) => { player = made; return made.ready; });
opening.catch((error) => {
  document.getElementById("labels").textContent = `This browser is too old for the page (${error.message}).`;
});
// For tests and pictures; everything but `ready` is there once that has resolved.
window.a2gPlayer = {
  ready: opening,
  get renderer() { return player.renderer.name; },
  get figures() { return player.figures.map(({ label, note, fps, frames, points }) => ({ label, note, fps, frames, points })); },
  play: () => player.play(),
  pause: () => player.pause(),
  seek: (time) => player.seek(time),
  time: () => player.now,
  frame: (index = 0) => Math.round(player.figures[index].frameAt(player.now)),
  solo: (index) => player.solo(index),
  view: (change) => player.view(change),
  playing: () => player.playing,
  vertices: (index = 0) => Array.from(player.figures[index].mesh.places),
  // Draws moving pictures from a second on, 25 of a second, each complete before the next.
  moving: (from, count) => {
    const { gl } = player.renderer, pixel = new Uint8Array(4);
    for (let i = 0; i < count; i++) {
      player.now = from + 0.04 * i;
      player.draw(performance.now(), false);
      if (gl) gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
  },
  pictures: () => player.pictures,
  scale: () => player.renderer.scale,
  speech: () => player.speech,
  // The tooltip of a position in the detailed timeline, in CSS pixels from its corner; lanes from top to bottom.
  tell: (x, y) => player.timeline.tell(x, y) || null,
  lanes: () => player.timeline.rows().map(({ kind, height, lane, figure }) => ({ kind, height, name: lane ? lane.name : kind, figure: figure ? figure.label : null })),
  // Resolves when a picture of the present moment, at full quality, is on screen.
  still: () => new Promise((done) => requestAnimationFrame((stamp) => {
    player.draw(stamp, true);
    clearTimeout(player.settling);
    requestAnimationFrame(() => requestAnimationFrame(() => done(true)));
  })),
};
