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
    this.labels = new Labels(this);
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
      this.labels.reset(width);
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
    this.labels.place(width);
    this.timeline.draw();
    this.showClock();
    this.labels.showDoing();
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
