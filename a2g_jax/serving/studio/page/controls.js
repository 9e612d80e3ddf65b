// Named controls: free, a level, or a curve over the speech; and choices such as emotions, constant or changing.

import { clamp, make, number } from "./dom.js";
import { CurveLane, secondsInput } from "./timeline.js";

// Ends of the scales in words, by the names of controls.
const ENDS = { energy: ["calm", "lively"], height: ["low hands", "high hands"], radius: ["close to the body", "wide"], rate: ["few gestures", "many"], handedness: ["left hand", "right hand"] };
const MODES = [["free", "Free"], ["level", "Level"], ["curve", "Curve"]];

const switchOf = (label, modes, mode, onChoose) => make("div", { class: "switch", role: "radiogroup", "aria-label": label },
  modes.map(([value, text]) => make("button", { type: "button", role: "radio", "aria-checked": String(value === mode), onclick: () => onChoose(value) }, text)));

// A quantity from 0 to 1.
export class Control {
  constructor(name, speech, onChange) {
    Object.assign(this, { name, speech, onChange, mode: "free", level: 0.5, points: null });
    this.element = make("div", { class: "control", "data-part": `controls.${name}` });
    this.show();
  }

  // What the request holds: nothing, a number, or points of (second, value).
  value() {
    if (this.mode === "free") return undefined;
    return this.mode === "level" ? this.level : this.points.map(([second, value]) => [Number(second.toFixed(3)), Number(value.toFixed(3))]);
  }

  set(value) {
    this.mode = value === undefined ? "free" : Array.isArray(value) ? "curve" : "level";
    if (this.mode === "level") this.level = Number(value);
    if (this.mode === "curve") this.points = value.map((point) => [...point]);
    this.show();
  }

  setSpeech(speech) {
    this.speech = speech;
    if (this.points) this.points = this.points.map(([second, value]) => [clamp(second, 0, speech.seconds - 0.01), value]).filter(([second], i, all) => i === 0 || second > all[i - 1][0]);
    if (this.mode === "curve") this.show();
  }

  choose(mode) {
    if (mode === "curve" && !this.points) this.points = [[0, this.mode === "level" ? this.level : 0.3], [0.8 * this.speech.seconds, 0.8]];
    this.mode = mode;
    this.show();
    this.element.querySelector('[aria-checked="true"]').focus();
    this.onChange();
  }

  show() {
    const head = make("div", { class: "line" }, make("b", {}, this.name), make("span", { class: "gap" }), switchOf(this.name, MODES, this.mode, (mode) => this.choose(mode)));
    const parts = [head];
    const [low, high] = ENDS[this.name] || ["little", "much"], ends = make("div", { class: "ends soft" }, make("span", {}, low), make("span", {}, high));
    if (this.mode === "level") {
      const output = make("output", {}, number(this.level));
      const input = make("input", { type: "range", min: 0, max: 1, step: 0.05, value: this.level, "aria-label": `${this.name}, from ${low} to ${high}`, oninput: () => { this.level = Number(input.value); output.textContent = number(this.level); this.onChange(); } });
      parts.push(make("div", { class: "slider" }, input, output), ends);
    }
    if (this.mode === "curve") {
      this.lane = new CurveLane(this.name, this.points, () => this.onChange());
      parts.push(this.lane.element, make("p", { class: "hint soft" }, `From ${low} (bottom) to ${high} (top). Tap to add a point, drag it, double-tap to remove it.`));
      this.lane.setSpeech(this.speech);
    }
    this.element.replaceChildren(...parts, make("p", { class: "error", role: "alert" }));
  }
}

// One of several names, or a sequence of them.
export class Choice {
  constructor(name, values, free, speech, onChange, part) {
    Object.assign(this, { name, values, free, speech, onChange, constant: "", steps: null });
    this.element = make("div", { class: "choice", "data-part": part });
    this.show();
  }

  // What the request holds: nothing, a name, or points of (second, name).
  value() {
    if (this.steps) return this.steps.map(({ second, name }) => [second, name]);
    return this.constant || undefined;
  }

  set(value) {
    this.steps = Array.isArray(value) ? value.map(([second, name]) => ({ second, name })) : null;
    this.constant = typeof value === "string" ? value : "";
    this.show();
  }

  setSpeech(speech) { this.speech = speech; }

  show() {
    const changes = make("button", { type: "button", class: "quiet", onclick: () => this.change(this.steps ? null : [{ second: 0, name: this.values[0] }, { second: Math.round(5 * this.speech.seconds) / 10, name: this.values[1] }]) }, this.steps ? "The same throughout" : "Change over time…");
    this.element.replaceChildren(this.steps ? this.sequence() : this.chips(), make("div", { class: "buttons" }, changes), make("p", { class: "error", role: "alert" }));
  }

  change(steps) { this.steps = steps; this.show(); this.onChange(); }

  chips() {
    const options = [["", this.free], ...this.values.map((value) => [value, value])];
    return make("div", { class: "choices", role: "radiogroup", "aria-label": this.name }, options.map(([value, text]) => make("button", { type: "button", role: "radio", class: "chip", "aria-checked": String(value === this.constant), onclick: () => { this.constant = value; this.show(); this.onChange(); } }, text)));
  }

  sequence() {
    const rows = this.steps.map((step, index) => {
      const select = make("select", { "aria-label": this.name, onchange: () => { step.name = select.value; this.onChange(); } }, this.values.map((value) => make("option", { value, selected: value === step.name }, value)));
      const [label] = secondsInput("from", step.second, (second) => { step.second = second ?? 0; this.onChange(); });
      const drop = make("button", { type: "button", class: "icon", "aria-label": `Remove ${step.name}`, disabled: this.steps.length < 2, onclick: () => this.change(this.steps.filter((_, other) => other !== index)) }, "×");
      return make("div", { class: "line" }, label, select, make("span", { class: "gap" }), drop);
    });
    const last = this.steps[this.steps.length - 1];
    const add = make("button", { type: "button", class: "quiet", onclick: () => this.change([...this.steps, { second: Math.round(10 * (last.second + this.speech.seconds) / 2) / 10, name: this.values[0] }]) }, "Add a change");
    return make("div", {}, rows, add);
  }
}
