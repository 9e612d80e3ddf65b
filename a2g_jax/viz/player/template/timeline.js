// The waveform of the whole clip (a scrubber), and a closer look around the present: words, speeds, tracks.

const WAVE = 44; // height of the closer waveform, CSS pixels

class Timeline {
  constructor(player) {
    this.player = player;
    this.overview = document.getElementById("overview");
    this.detail = document.getElementById("detail");
    this.peaks = null;
    this.hover = null;
    this.style();
    this.attach(this.overview.parentElement, (x, width) => x / width * player.duration);
    this.attach(this.detail.parentElement, (x, width) => { const [from, to] = this.window(); return from + x / width * (to - from); });
    this.hovering = new Hover(this);
  }

  style() {
    const style = getComputedStyle(document.documentElement), names = ["ink", "soft", "faint", "line", "accent", "wave", "wave-past", "raised", "press", "pitch"];
    this.ink = Object.fromEntries(names.map((name) => [name, style.getPropertyValue("--" + name).trim()]));
    this.sketch = this.strip = null;
  }

  attach(element, timeAt) {
    const seek = (event) => {
      const box = element.getBoundingClientRect();
      this.player.seek(timeAt(event.clientX - box.left, box.width));
    };
    let held = null;
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      held = this.heldWindow = this.window();
      element.setPointerCapture(event.pointerId);
      seek(event);
    });
    element.addEventListener("pointermove", (event) => { if (held) seek(event); });
    for (const name of ["pointerup", "pointercancel"]) element.addEventListener(name, () => { held = this.heldWindow = null; this.player.wake(); });
  }

  // Loudest sample of each of many short pieces, from 16-bit PCM.
  load(samples, rate) {
    const step = Math.max(1, Math.round(rate / 400)), count = Math.ceil(samples.length / step);
    this.peaks = new Float32Array(count);
    let loudest = 1e-4;
    for (let i = 0; i < count; i++) {
      let peak = 0;
      for (let k = i * step; k < Math.min((i + 1) * step, samples.length); k++) peak = Math.max(peak, Math.abs(samples[k]));
      this.peaks[i] = peak / 32768;
      loudest = Math.max(loudest, this.peaks[i]);
    }
    for (let i = 0; i < count; i++) this.peaks[i] /= loudest;
    this.perSecond = rate / step;
  }

  // Span of time of the closer look. While a pointer seeks in it, it stays.
  window() {
    if (this.heldWindow) return this.heldWindow;
    const { duration } = this.player, span = Math.min(duration, this.detail.clientWidth < 640 ? 5 : 10);
    const from = clamp(this.player.now - 0.4 * span, 0, duration - span);
    return [from, from + span];
  }

  // A drawing context in CSS pixels. Software canvases: these pictures are copied every frame, and drawn rarely.
  context(canvas, width, height) {
    const ratio = this.ratio = Math.min(window.devicePixelRatio || 1, 2), w = Math.round(width * ratio), h = Math.round(height * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const g = canvas.getContext("2d", { willReadFrequently: true });
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    return g;
  }

  size(canvas, height) {
    const width = canvas.clientWidth;
    if (canvas.style.height !== height + "px") canvas.style.height = height + "px";
    const g = this.context(canvas, width, height);
    g.clearRect(0, 0, width, height);
    return [g, width];
  }

  // Copy part of a drawn picture, in CSS pixels.
  copy(g, picture, x, y, width, height, toX, toY) {
    const r = this.ratio;
    if (width > 0) g.drawImage(picture, x * r, y * r, width * r, height * r, toX, toY, width, height);
  }

  wave(g, width, y, height, from, to, colour) {
    const middle = y + height / 2, bars = Math.floor(width / 2);
    g.fillStyle = colour;
    g.beginPath();
    for (let i = 0; i < bars; i++) {
      let peak = 0;
      if (this.peaks) {
        const a = Math.floor((from + (to - from) * i / bars) * this.perSecond), b = Math.max(a + 1, Math.floor((from + (to - from) * (i + 1) / bars) * this.perSecond));
        for (let k = Math.max(a, 0); k < Math.min(b, this.peaks.length); k++) peak = Math.max(peak, this.peaks[k]);
      }
      const tall = Math.max(0.6, Math.pow(peak, 0.8) * (height / 2 - 1));
      g.rect(2 * i, middle - tall, 1.3, 2 * tall);
    }
    g.fill();
  }

  draw() {
    const { duration, now } = this.player, height = 34, [g, width] = this.size(this.overview, height);
    if (width < 2) return;
    if (!this.sketch || this.sketch.wide !== width || this.sketch.ratio !== this.ratio) {
      // The whole waveform, as it looks before and after the playhead.
      const picture = document.createElement("canvas"), s = this.context(picture, width, 2 * height);
      this.wave(s, width, 0, height, 0, duration, this.ink.wave);
      this.wave(s, width, height, height, 0, duration, this.ink["wave-past"]);
      this.sketch = { picture, wide: width, ratio: this.ratio };
    }
    const [from, to] = this.window(), x = now / duration * width;
    if (to - from < duration - 0.01) {
      g.fillStyle = this.ink.press;
      g.beginPath(); g.roundRect(from / duration * width, 0, (to - from) / duration * width, height, 4); g.fill();
    }
    const split = Math.round(x * this.ratio) / this.ratio;
    this.copy(g, this.sketch.picture, 0, height, split, height, 0, 0);
    this.copy(g, this.sketch.picture, split, 0, width - split, height, split, 0);
    g.fillStyle = this.ink.accent;
    g.beginPath(); g.roundRect(clamp(x - 1, 0, width - 2), 0, 2, height, 1); g.fill();
    this.drawDetail(from, to);
  }

  rows() {
    const { player } = this, rows = [{ kind: "wave", height: WAVE }];
    if (player.words.length) rows.push({ kind: "words", height: 20 });
    const compact = player.shown().length > 1, lane = (lane, figure) => rows.push({ kind: kindOf(lane), height: LANES[kindOf(lane)].height(compact), lane, figure, compact });
    for (const shared of player.lanes) lane(shared, null);
    for (const figure of player.shown()) for (const track of figure.tracks) lane(track, figure);
    if (player.shown().some((figure) => figure.wrists.length)) rows.push({ kind: "speed", height: 40 });
    return rows;
  }

  // The rows are drawn into a strip longer than the window, which then slides over it.
  makeStrip(rows, height, width, from, to) {
    const span = to - from, start = Math.max(0, from - 0.3 * span), end = Math.min(this.player.duration, start + 2.6 * span);
    const wide = (end - start) / span * width, picture = document.createElement("canvas");
    const g = this.context(picture, wide, height + WAVE), at = (time) => (time - start) / span * width;
    this.strip = { picture, start, end, at, width, height, ratio: this.ratio, rows, spoken: [] };
    let y = 4;
    for (const row of rows) {
      if (row.kind === "wave") {
        this.wave(g, wide, y, WAVE, start, end, this.ink.wave);
        this.wave(g, wide, height, WAVE, start, end, this.ink["wave-past"]);
      } else if (row.kind === "words") this.drawWords(g, at, start, end, y + 14);
      else if (row.lane) LANES[row.kind].draw(g, { at, from: start, to: end, y, wide, ink: this.ink, ...row });
      else this.drawSpeeds(g, wide, at, start, end, y + 4, row.height - 6);
      y += row.height;
    }
  }

  drawDetail(from, to) {
    const rows = this.rows(), height = rows.reduce((sum, row) => sum + row.height, 0) + 6, { now } = this.player;
    const [g, width] = this.size(this.detail, height);
    const same = (a, b) => a.length === b.length && a.every((row, i) => row.kind === b[i].kind && row.lane === b[i].lane);
    const old = this.strip, kept = old && old.width === width && old.ratio === this.ratio && old.only === this.player.only
      && from >= old.start - 1e-6 && to <= old.end + 1e-6 && Math.abs(old.at(to) - old.at(from) - width) < 0.5 && same(rows, old.rows);
    if (!kept) { this.makeStrip(rows, height, width, from, to); this.strip.only = this.player.only; }
    // Whole device pixels, or bars and letters would blur.
    const { picture, at, spoken } = this.strip, shift = Math.round(at(from) * this.ratio) / this.ratio, head = at(now) - shift;
    this.copy(g, picture, shift, 0, width, height, 0, 0);
    g.clearRect(0, 4, head, WAVE);
    this.copy(g, picture, shift, height, head, WAVE, 0, 4);
    g.font = "12.5px system-ui, sans-serif"; g.fillStyle = this.ink.accent;
    for (const word of spoken) if (now >= word.start && now < word.end) {
      g.clearRect(word.x - shift, word.y - 13, word.wide, 18); g.fillText(word.text, word.x - shift, word.y);
    }
    let y = 4;
    for (const row of rows) {
      if (row.lane) this.drawName(g, row.figure ? row.figure.colour : null, this.nameOf(row), row.figure ? y : y - 2);
      if (row.kind === "speed") this.drawName(g, null, `wrist speed, 0–${this.player.fastest.toFixed(1)} m/s`, y - 2);
      y += row.height;
    }
    g.fillStyle = this.ink.accent;
    g.fillRect(head - 0.75, 0, 1.5, height);
  }

  nameOf({ figure, lane, kind }) {
    const name = LANES[kind].name ? LANES[kind].name(lane) : lane.name;
    return figure && this.player.figures.length > 1 ? [figure.label, name].filter(Boolean).join(" · ") : name;
  }

  // The tooltip of a position in the detailed timeline: lines of text, or nothing.
  tell(x, y) {
    const [from, to] = this.window(), perPixel = (to - from) / Math.max(this.detail.clientWidth, 1), time = from + x * perPixel;
    let top = 4;
    for (const row of this.rows()) {
      if (y >= top && y < top + row.height) {
        if (row.lane) return LANES[row.kind].tell(row.lane, time, y - top, 7 * perPixel, row.compact);
        if (row.kind === "words") { const word = this.player.words.find(([, start, end]) => time >= start && time < end); return word && [word[0], `${seconds(word[1])} to ${seconds(word[2])}`]; }
        if (row.kind === "speed") return [seconds(time), ...this.player.shown().map((figure) => `${figure.label}: ${figure.speeds[Math.round(figure.frameAt(time))].toFixed(2)} m/s`)];
        return null;
      }
      top += row.height;
    }
    return null;
  }

  drawName(g, colour, name, y) {
    g.font = "11px system-ui, sans-serif";
    const inset = colour ? 15 : 4;
    g.fillStyle = this.ink.raised; g.globalAlpha = 0.86;
    g.beginPath(); g.roundRect(0, y + 2, g.measureText(name).width + inset + 5, 15, 3); g.fill(); g.globalAlpha = 1;
    if (colour) { g.fillStyle = colour; g.beginPath(); g.arc(7, y + 9.5, 3.5, 0, 7); g.fill(); }
    g.fillStyle = colour ? this.ink.soft : this.ink.faint; g.fillText(name, inset, y + 13.5);
  }

  drawWords(g, at, from, to, y) {
    g.font = "12.5px system-ui, sans-serif"; g.fillStyle = this.ink.soft;
    let free = -Infinity;
    for (const [text, start, end] of this.player.words) {
      if (end < from || start > to) continue;
      const x = at(start), wide = g.measureText(text).width;
      if (x < free) continue;
      g.fillText(text, x, y);
      this.strip.spoken.push({ text, start, end, x, y, wide });
      free = x + wide + 4;
    }
  }

  drawSpeeds(g, width, at, from, to, y, height) {
    g.lineWidth = 1.3; g.lineJoin = "round";
    for (const figure of this.player.shown()) {
      g.strokeStyle = figure.colour; g.globalAlpha = 0.9; g.beginPath();
      const a = Math.max(0, Math.floor(from * figure.fps)), b = Math.min(figure.frames - 1, Math.ceil(to * figure.fps)), skip = Math.max(1, Math.floor((b - a) / width));
      for (let t = a - (a % skip); t <= b; t += skip) g.lineTo(at(t / figure.fps), y + height - Math.min(figure.speeds[t] / this.player.fastest, 1) * (height - 2));
      g.stroke(); g.globalAlpha = 1;
      this.drawApexes(g, figure, at, from, to, (speed) => y + height - Math.min(speed / this.player.fastest, 1) * (height - 2));
    }
  }

  drawApexes(g, figure, at, from, to, level) {
    for (const lane of figure.tracks) for (const [time, , , key] of lane.marks || []) {
      if (time < from || time > to) continue;
      diamond(g, at(time), level(figure.speeds[Math.round(figure.frameAt(time))]), 3.4);
      g.fillStyle = keyColour(key); g.strokeStyle = this.ink.raised; g.lineWidth = 1.2; g.stroke(); g.fill(); g.lineWidth = 1.3;
    }
  }
}
