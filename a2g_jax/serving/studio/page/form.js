// The request: fields of the chosen system, and their values.

import { Refused, get, post, upload } from "./api.js";
import { Choice, Control } from "./controls.js";
import { clearErrors, find, make, number, showError, tell } from "./dom.js";
import { beginSpeech, speech } from "./speech.js";
import { PinLane, secondsInput } from "./timeline.js";

const described = new Map();
const state = { system: null, controls: [], choices: [], emotion: null, pins: [], files: {}, settings: new Map() };
let lane = null;

export async function beginForm(about, onTake) {
  beginSpeech(about, (chosen) => {
    for (const part of [...state.controls, ...state.choices, state.emotion]) part?.setSpeech(chosen);
    lane?.setSpeech(chosen);
  });
  lane = new PinLane((pin) => { pin.input.value = pin.start; });
  lane.setSpeech(speech());
  for (const id of ["pin", "style", "style-with", "continue"]) find(`${id}-file`).accept = about.accept.clip;
  find("character-file").accept = about.accept.character;
  find("samples").max = about.most_samples;
  onFile("pin-file", (file) => addPin(file));
  for (const name of ["style", "style-with", "continue", "character"]) onFile(`${name}-file`, (file) => takeFile(name, file));
  for (const id of ["style-share", "style-mix"]) find(id).addEventListener("input", ({ target }) => { target.nextElementSibling.textContent = number(Number(target.value)); });
  for (const button of document.querySelectorAll("[data-step]")) button.addEventListener("click", () => { const field = find("samples"); field.value = Math.min(Math.max(Number(field.value) + Number(button.dataset.step), 1), about.most_samples); });
  find("dice").addEventListener("click", () => { find("seed").value = Math.floor(Math.random() * 100000); });
  find("systems").replaceChildren(...about.systems.map((name) => make("button", { type: "button", role: "radio", class: "chip", "aria-checked": "false", "data-name": name, onclick: () => chooseSystem(name) }, about.titles[name] || name, about.titles[name] && make("span", { class: "soft" }, `(${name})`))));
  find("form").addEventListener("submit", (event) => { event.preventDefault(); submit(onTake); });
  await chooseSystem(about.first);
}

function onFile(id, use) {
  find(id).addEventListener("change", ({ target }) => { if (target.files[0]) use(target.files[0]); target.value = ""; });
}

// --- the system, and the fields that it has ---

async function chooseSystem(name) {
  state.system = name;
  for (const chip of find("systems").children) chip.setAttribute("aria-checked", String(chip.dataset.name === name));
  const says = find("system-about");
  clearErrors(says.parentElement);
  if (!described.has(name)) {
    says.textContent = "loading…";
    try { described.set(name, await get(`api/systems/${encodeURIComponent(name)}`)); } catch (error) { says.textContent = ""; showError("system", error.message); return; }
  }
  if (state.system !== name) return;
  const can = described.get(name), kept = controlValues();
  says.textContent = summary(can);
  says.title = can.title;
  const change = () => summaries();
  state.controls = can.controls.map((control) => new Control(control, speech(), change));
  state.choices = Object.entries(can.categories).map(([control, values]) => new Choice(control, values, "any", speech(), change, `controls.${control}`));
  state.emotion = can.emotions.length ? new Choice("emotion", can.emotions, "from the speech", speech(), change, "emotion") : null;
  for (const part of [...state.controls, ...state.choices]) if (kept[part.name] !== undefined) part.set(kept[part.name]);
  const emotional = [...state.choices, state.emotion].filter((part) => part);
  find("emotion").replaceChildren(...emotional.map((part) => part.element));
  find("emotion-section").hidden = !emotional.length;
  find("emotion-section").querySelector("h2").textContent = emotional.map((part) => part.name[0].toUpperCase() + part.name.slice(1)).join(", ");
  find("controls").replaceChildren(...state.controls.map((part) => part.element));
  find("controls-section").hidden = !state.controls.length;
  find("style-section").hidden = !can.styles;
  find("continue-section").hidden = !can.seed_clips;
  find("pins-section").hidden = !can.pins;
  fillSettings(can.settings);
  summaries();
}

function summary(can) {
  const parts = [];
  parts.push(...can.controls, ...Object.keys(can.categories));
  if (can.emotions.length) parts.push("emotion");
  if (can.styles) parts.push("the style of a clip");
  if (can.seed_clips) parts.push("a clip to continue");
  return parts.length ? `You can choose ${parts.slice(0, -1).join(", ")}${parts.length > 1 ? " and " : ""}${parts.at(-1)}.` : "Gestures follow the speech alone.";
}

// What the folds hold, where they are closed.
function summaries() {
  const set = state.controls.filter((part) => part.value() !== undefined).map((part) => part.name);
  const say = (id, text) => { find(id).querySelector(".summary").textContent = text; };
  say("controls-section", set.length ? set.join(", ") : "free");
  say("pins-section", state.pins.length ? `${state.pins.length}` : "none");
  say("character-section", state.files.character?.name || "none");
  say("more", [...Object.keys(state.files).filter((name) => name !== "character").map((name) => (name === "style-with" ? "blend" : name)), ...state.settings.keys()].join(", "));
}

function fillSettings(settings) {
  state.settings = new Map();
  find("settings-section").hidden = !settings.length;
  find("settings").replaceChildren(...settings.map((setting) => {
    const change = (value) => { if (value === null) state.settings.delete(setting.name); else state.settings.set(setting.name, value); summaries(); };
    const usual = Array.isArray(setting.value) ? setting.value.join(", ") : setting.value === null ? "not set" : String(setting.value);
    let input;
    if (setting.kind === "bool") input = make("input", { type: "checkbox", checked: setting.value, onchange: () => change(input.checked === setting.value ? null : input.checked) });
    else input = make("input", { type: setting.kind === "str" ? "text" : "number", step: "any", placeholder: usual, oninput: () => change(input.value.trim() === "" ? null : setting.repeat ? input.value.split(";").map((part) => part.trim()).filter(Boolean) : input.value.trim()) });
    return make("div", { class: "setting", "data-part": `settings.${setting.name}` },
      make("label", { class: setting.kind === "bool" ? "check" : "" }, make("span", {}, setting.name.replaceAll("-", " ")), input), make("p", { class: "hint soft" }, setting.about.replaceAll(/ \(:\w+:`[^`]*`\)|:\w+:`[^`]*`/g, "")), make("p", { class: "error", role: "alert" }));
  }));
}

// --- files ---

async function sendFile(field, kind, file) {
  const place = document.querySelector(`[data-field="${field}"]`);
  clearErrors(place);
  place.classList.add("waiting");
  try { return await upload(kind, file, file.name); } catch (error) { showError(field, error.message); return null; } finally { place.classList.remove("waiting"); }
}

export async function addPin(file) {
  find("pins-section").open = true;
  const clip = await sendFile("pins", "clip", file);
  if (!clip) return;
  const last = state.pins.reduce((end, pin) => Math.max(end, pin.start + lane.length(pin)), 0);
  const room = speech().seconds - clip.seconds;
  const start = Math.max(Math.min(Math.round(10 * (last + 2)) / 10, Math.floor(10 * (room - 0.5)) / 10), 0);
  state.pins.push({ clip, start, length: clip.seconds > speech().seconds - start ? Math.floor(10 * (speech().seconds - start - 0.5)) / 10 : null });
  showPins();
  tell(`${clip.name} starts at ${number(start)} seconds`);
}

function showPins() {
  const rows = state.pins.map((pin) => {
    const [startLabel, startInput] = secondsInput("at", pin.start, (value) => { pin.start = value ?? 0; lane.draw(); });
    const [lengthLabel] = secondsInput("for", pin.length, (value) => { pin.length = value; lane.draw(); }, number(pin.clip.seconds));
    pin.input = startInput;
    const drop = make("button", { type: "button", class: "icon", "aria-label": `Remove ${pin.clip.name}`, onclick: () => { state.pins = state.pins.filter((other) => other !== pin); showPins(); } }, "×");
    return make("div", { class: "pin" }, make("b", {}, pin.clip.name), make("div", { class: "line" }, startLabel, lengthLabel, make("span", { class: "gap" }), drop));
  });
  find("pins").replaceChildren(...(rows.length ? [lane.element, ...rows] : []));
  lane.setPins(state.pins);
  summaries();
}

async function takeFile(name, file) {
  const sent = await sendFile(name.replace("-", "_"), name === "character" ? "character" : "clip", file);
  if (sent) setFile(name, sent);
}

function setFile(name, sent) {
  if (sent) state.files[name] = sent; else delete state.files[name];
  const shown = find(`${name}-name`);
  shown.hidden = !sent;
  shown.replaceChildren(...(sent ? [make("b", {}, sent.name), make("button", { type: "button", class: "icon", "aria-label": `Without ${sent.name}`, onclick: () => setFile(name, null) }, "×")] : []));
  find("style-share-row").hidden = find("style-with-part").hidden = !state.files.style;
  find("style-mix-row").hidden = !state.files["style-with"];
  summaries();
}

// --- the request ---

function controlValues() {
  const parts = [...state.controls, ...state.choices].map((part) => [part.name, part.value()]);
  return Object.fromEntries(parts.filter(([, value]) => value !== undefined));
}

function emotionText() {
  const value = state.emotion?.value();
  return Array.isArray(value) ? value.map(([second, name]) => `${name}@${second}`).join(",") : value;
}

export function request() {
  const can = described.get(state.system) || {}, files = state.files, blends = can.styles && files.style && files["style-with"];
  return {
    speech: speech().id,
    system: state.system,
    samples: Number(find("samples").value),
    seed: Number(find("seed").value),
    emotion: emotionText(),
    controls: controlValues(),
    pins: can.pins ? state.pins.map(({ clip, start, length }) => ({ clip: clip.id, start, length })) : [],
    style: can.styles ? files.style?.id : undefined,
    style_share: can.styles && files.style ? Number(find("style-share").value) : undefined,
    style_with: blends ? files["style-with"].id : undefined,
    style_mix: blends ? Number(find("style-mix").value) : undefined,
    continue: can.seed_clips ? files.continue?.id : undefined,
    character: files.character?.id,
    settings: Object.fromEntries(state.settings),
  };
}

// Values of an earlier request, apart from its files.
export async function reuse(values) {
  find("samples").value = values.samples;
  find("seed").value = values.seed;
  await chooseSystem(values.system);
  for (const part of [...state.controls, ...state.choices]) part.set(values.controls[part.name]);
  if (state.emotion) state.emotion.set(values.emotion && values.emotion.includes("@") ? values.emotion.split(",").map((part) => [Number(part.split("@")[1]), part.split("@")[0]]) : values.emotion);
  summaries();
  tell("settings are as in that take");
}

async function submit(onTake) {
  clearErrors();
  const button = find("generate");
  button.disabled = true;
  try { onTake(await post("api/takes", request())); } catch (error) {
    showError(error instanceof Refused ? error.field || "" : "", error.message);
  } finally { button.disabled = false; }
}
