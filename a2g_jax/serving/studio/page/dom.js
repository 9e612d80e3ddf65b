// Small helpers for elements.

export const find = (id) => document.getElementById(id);

// An element with attributes, listeners (on...) and children; text is text, never markup.
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  set(element, attributes);
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  set(element, attributes);
  element.append(...children);
  return element;
}

function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
}

export const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// Seconds as 0:04 or 1:20:03.
export function clock(seconds) {
  const whole = Math.round(seconds), two = (number) => String(number).padStart(2, "0");
  const minutes = Math.floor(whole / 60) % 60, hours = Math.floor(whole / 3600);
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

// Seconds in words, for estimates.
export function duration(seconds) {
  if (seconds < 1.5) return "1 s";
  if (seconds < 90) return `${Math.round(seconds)} s`;
  return `${Math.round(seconds / 60)} min`;
}

export const number = (value, digits = 2) => Number(value.toFixed(digits)).toString();

export function tell(text) { find("status").textContent = text; }

// The message beside a field, or below the form where it is about none that is shown; a field within a fold opens it.
export function showError(field, message) {
  const named = [`[data-part="${CSS.escape(field)}"]`, `[data-field="${CSS.escape(field.split(".")[0])}"]`];
  const place = field ? named.map((query) => document.querySelector(query)).find((element) => element && !element.closest("[hidden]")) : null;
  const line = (place && place.querySelector(":scope > .error")) || find("form-error");
  line.textContent = message;
  for (let fold = line.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  line.scrollIntoView({ block: "nearest" });
}

export function clearErrors(within = document) {
  for (const line of within.querySelectorAll(".error")) line.textContent = "";
}

// A waveform in an SVG, as one path in a box of 0 to 1.
export function drawWave(element, peaks, kind = "wave-path") {
  const step = 1 / Math.max(peaks.length, 1);
  const points = peaks.map((peak, i) => `M${((i + 0.5) * step).toFixed(5)} ${(0.5 - 0.47 * Math.max(peak, 0.015)).toFixed(4)}V${(0.5 + 0.47 * Math.max(peak, 0.015)).toFixed(4)}`);
  element.setAttribute("viewBox", "0 0 1 1");
  element.setAttribute("preserveAspectRatio", "none");
  element.replaceChildren(svg("path", { class: kind, d: points.join("") }));
}
