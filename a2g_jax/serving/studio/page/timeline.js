// Editors over the time of the speech: curves of a control, and clips at their seconds.

import { clamp, make, number, svg } from "./dom.js";

const EDGE = 10; // CSS pixels left and right of the first and last second

class Lane {
  constructor(height, label) {
    this.height = height;
    this.seconds = 1;
    this.peaks = [];
    this.element = svg("svg", { class: "lane", height, role: "group", "aria-label": label });
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  setSpeech({ seconds, peaks }) {
    Object.assign(this, { seconds, peaks });
    this.draw();
  }

  get width() { return Math.max(this.element.clientWidth, 40); }
  x(second) { return EDGE + (this.width - 2 * EDGE) * second / this.seconds; }
  second(x) { return clamp((x - EDGE) / (this.width - 2 * EDGE), 0, 1) * this.seconds; }

  at(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  // The waveform, and the seconds under it.
  back() {
    const parts = [], middle = (this.height - 14) / 2, wide = (this.width - 2 * EDGE) / Math.max(this.peaks.length, 1);
    const path = this.peaks.map((peak, i) => `M${(EDGE + (i + 0.5) * wide).toFixed(1)} ${(middle - 0.9 * middle * peak - 0.5).toFixed(1)}V${(middle + 0.9 * middle * peak + 0.5).toFixed(1)}`);
    parts.push(svg("path", { class: "wave-back", d: path.join("") }));
    const every = [0.5, 1, 2, 5, 10, 20, 30, 60, 120].find((step) => (this.width - 2 * EDGE) * step / this.seconds >= 44) || 300;
    for (let second = 0; second <= this.seconds + 1e-6; second += every) {
      const text = svg("text", { class: "tick", x: Math.max(this.x(second), 16), y: this.height - 4 });
      text.textContent = `${number(second, 1)} s`;
      if (this.x(second) < this.width - 18) parts.push(svg("line", { class: "tick-line", x1: this.x(second), x2: this.x(second), y1: 0, y2: this.height - 14 }), text);
    }
    return parts;
  }
}

// Values over time: tap to add a point, drag to move it, double tap or Delete to remove it; arrows move the focused one.
export class CurveLane extends Lane {
  constructor(name, points, onChange) {
    super(112, `Curve of ${name}`);
    this.name = name;
    this.points = points;
    this.onChange = onChange;
    this.element.addEventListener("pointerdown", (event) => this.press(event));
  }

  y(value) { return 10 + (this.height - 34) * (1 - value); }
  value(y) { return clamp(1 - (y - 10) / (this.height - 34), 0, 1); }

  draw() {
    const line = this.points.map(([second, value]) => `${this.x(second).toFixed(1)},${this.y(value).toFixed(1)}`);
    const [first, last] = [this.points[0], this.points[this.points.length - 1]];
    const whole = [`${EDGE},${this.y(first[1])}`, ...line, `${this.width - EDGE},${this.y(last[1])}`].join(" ");
    this.element.replaceChildren(...this.back(), svg("polyline", { class: "curve", points: whole }), ...this.points.map((point, i) => this.handle(point, i)));
  }

  handle([second, value], index) {
    const says = `${this.name} ${number(value)} at ${number(second)} seconds`;
    const circle = svg("g", { class: "handle", tabindex: 0, role: "slider", "aria-label": says, "aria-valuemin": 0, "aria-valuemax": 1, "aria-valuenow": number(value), transform: `translate(${this.x(second).toFixed(1)} ${this.y(value).toFixed(1)})` },
      svg("circle", { class: "reach", r: 22 }), svg("circle", { r: 7 }));
    circle.addEventListener("keydown", (event) => this.key(event, index));
    circle.addEventListener("dblclick", () => this.remove(index));
    return circle;
  }

  press(event) {
    const [x, y] = this.at(event);
    let index = this.nearest(x, y);
    if (index < 0) {
      const second = this.second(x);
      index = this.points.findIndex(([other]) => other > second);
      index = index < 0 ? this.points.length : index;
      this.points.splice(index, 0, [second, this.value(y)]);
    }
    event.preventDefault();
    this.element.setPointerCapture(event.pointerId);
    const move = (moved) => { this.place(index, this.second(this.at(moved)[0]), this.value(this.at(moved)[1])); };
    const end = () => { this.element.removeEventListener("pointermove", move); this.focus(index); };
    this.element.addEventListener("pointermove", move);
    for (const name of ["pointerup", "pointercancel"]) this.element.addEventListener(name, end, { once: true });
    this.change();
  }

  nearest(x, y) {
    const far = this.points.map(([second, value]) => Math.hypot(this.x(second) - x, this.y(value) - y));
    const index = far.indexOf(Math.min(...far));
    return far[index] < 20 ? index : -1;
  }

  // Points stay in order, a tenth of a second apart.
  place(index, second, value) {
    const before = index > 0 ? this.points[index - 1][0] + 0.1 : 0, after = index + 1 < this.points.length ? this.points[index + 1][0] - 0.1 : this.seconds - 0.01;
    this.points[index] = [clamp(second, Math.min(before, after), Math.max(after, 0)), value];
    this.change();
  }

  key(event, index) {
    const [second, value] = this.points[index], step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05] }[event.key];
    if (event.key === "Delete" || event.key === "Backspace") this.remove(index);
    else if (step) this.place(index, second + step[0], clamp(value + step[1], 0, 1));
    else return;
    event.preventDefault();
    this.focus(Math.min(index, this.points.length - 1));
  }

  remove(index) {
    if (this.points.length < 2) return;
    this.points.splice(index, 1);
    this.change();
  }

  focus(index) { this.element.querySelectorAll(".handle")[index]?.focus(); }
  change() { this.draw(); this.onChange(); }
}

// Clips as blocks that are dragged along the time.
export class PinLane extends Lane {
  constructor(onMove) {
    super(84, "Clips over the speech");
    this.pins = [];
    this.onMove = onMove;
    this.element.addEventListener("pointerdown", (event) => this.press(event));
  }

  setPins(pins) { this.pins = pins; this.draw(); }
  length(pin) { return pin.length ?? pin.clip.seconds; }

  draw() {
    const blocks = this.pins.map((pin) => {
      const from = this.x(pin.start), wide = Math.max(this.x(pin.start + this.length(pin)) - from, 6);
      const name = svg("text", { x: 6, y: 27 });
      name.textContent = wide > 50 ? pin.clip.name.slice(0, Math.floor(wide / 7)) : "";
      return svg("g", { class: `block${pin.start + this.length(pin) > this.seconds + 0.02 ? " over" : ""}`, transform: `translate(${from.toFixed(1)} 13)` }, svg("rect", { width: wide.toFixed(1), height: 44, rx: 6 }), name);
    });
    this.element.replaceChildren(...this.back(), ...blocks);
  }

  press(event) {
    const [x] = this.at(event);
    const pin = this.pins.findLast((one) => x >= this.x(one.start) - 12 && x <= this.x(one.start + this.length(one)) + 12);
    if (!pin) return;
    event.preventDefault();
    this.element.setPointerCapture(event.pointerId);
    const offset = this.second(x) - pin.start;
    const move = (moved) => {
      pin.start = Math.round(100 * clamp(this.second(this.at(moved)[0]) - offset, 0, Math.max(this.seconds - this.length(pin), 0))) / 100;
      this.draw();
      this.onMove(pin);
    };
    this.element.addEventListener("pointermove", move);
    for (const name of ["pointerup", "pointercancel"]) this.element.addEventListener(name, () => this.element.removeEventListener("pointermove", move), { once: true });
  }
}

// A labelled number input of seconds.
export function secondsInput(label, value, onChange, placeholder = "") {
  const input = make("input", { type: "number", min: 0, step: 0.1, inputmode: "decimal", value: value ?? "", placeholder, oninput: () => onChange(input.value === "" ? null : Number(input.value)) });
  return [make("label", { class: "seconds" }, make("span", {}, label), input, " s"), input];
}
