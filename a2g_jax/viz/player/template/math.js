// Small vectors and matrices. Matrices are column-major arrays of 16, as WebGL takes them.

const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
const mix = (a, b, w) => a + (b - a) * w;
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(a[0], a[1], a[2]) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++)
    for (let r = 0; r < 4; r++)
      out[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
  return out;
}

// Perspective with a shift of the picture in units of half its size, so that a scene can be centred in free space.
function perspective(fov, aspect, near, far, shiftX, shiftY) {
  const f = 1 / Math.tan(fov / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, -shiftX, -shiftY, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}

function orthographic(left, right, bottom, top, near, far) {
  return [2 / (right - left), 0, 0, 0, 0, 2 / (top - bottom), 0, 0, 0, 0, -2 / (far - near), 0,
    -(right + left) / (right - left), -(top + bottom) / (top - bottom), -(far + near) / (far - near), 1];
}

function lookAt(eye, target, up) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
}

function project(m, p) {
  const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
  return [(m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w, (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w, w];
}

// "#rrggbb" to linear light.
const linear = (hex) => [1, 3, 5].map((i) => Math.pow(parseInt(hex.slice(i, i + 2), 16) / 255, 2.2));
const display = (rgb, alpha = 1) => `rgba(${rgb.map((c) => Math.round(255 * Math.pow(clamp(c, 0, 1), 1 / 2.2))).join(",")},${alpha})`;

const PALETTE = ["#4c7fe0", "#e5705a", "#3fa27a", "#8f6fd6", "#dc9a35", "#2f9fb3", "#d6639c", "#7c8b3a", "#a5694f", "#5d7186"];
const KEYS = {
  preparation: "#e8ad3d", stroke: "#e0543f", hold: "#8f6fd6", retraction: "#3f9ec4", rest: "#98a3b0",
  left: "#4c7fe0", right: "#e5705a", both: "#3fa27a",
  beat: "#d98a12", offer: "#16966a", sweep: "#2583c4", point: "#d8433b", list: "#8757cf", frame: "#cf4f9b",
};

function keyColour(key) {
  if (/^#[0-9a-f]{6}$/i.test(key)) return key;
  if (Object.hasOwn(KEYS, key)) return KEYS[key];
  let hash = 7;
  for (const character of key) hash = (hash * 31 + character.codePointAt(0)) % 9973;
  return PALETTE[hash % PALETTE.length];
}

// Colours of the stage in both themes.
const THEMES = {
  light: {
    top: "#f4f8fc", horizon: "#d9e2ec", groundA: "#e4e9ef", groundB: "#d3dae3", sun: [2.2, 2.13, 2.0], sky: [0.66, 0.72, 0.82],
    bounce: [0.42, 0.41, 0.4], shadow: 0.56, contact: 0.75, shadowTint: "#42526b", skin: "#e9c4a6", cloth: "#47536a",
  },
  dark: {
    top: "#14181e", horizon: "#2a313b", groundA: "#313944", groundB: "#282f39", sun: [1.9, 1.83, 1.72], sky: [0.34, 0.4, 0.5],
    bounce: [0.14, 0.15, 0.17], shadow: 0.66, contact: 0.75, shadowTint: "#05070a", skin: "#dcb798", cloth: "#475268",
  },
};
