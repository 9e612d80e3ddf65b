// Lanes of the timeline. Each kind of lane has a height, draws itself into the strip, and has a tooltip for a position.
// `compact`: several figures are shown, so each lane gets less room.

const SMALL = "11px system-ui, sans-serif";
const PHASES = { rest: [0, 0], preparation: [0.12, 0.62], stroke: [1, 1], hold: [0.62, 0.62], retraction: [0.62, 0.12] };

const SHORT = { preparation: "prep", retraction: "return" };

const kindOf = (lane) => (lane.spans ? "spans" : lane.bars ? "bars" : lane.values ? "curve" : "hands");
const seconds = (time) => `${time.toFixed(2)} s`;
const between = (list, time) => list.find(([start, end]) => time >= start && time < end);

function outlined(g, text, x, y, ink, paper) {
  g.lineWidth = 3; g.lineJoin = "round"; g.strokeStyle = paper; g.strokeText(text, x, y);
  g.fillStyle = ink; g.fillText(text, x, y);
}

function diamond(g, x, y, r) {
  g.beginPath(); g.moveTo(x, y - r); g.lineTo(x + r, y); g.lineTo(x, y + r); g.lineTo(x - r, y); g.closePath();
}

const LANES = {
  spans: {
    height: () => 19,
    draw(g, { at, from, to, y, wide, ink, lane }) {
      g.fillStyle = ink.press;
      g.globalAlpha = 0.5; g.fillRect(0, y + 2, wide, 15); g.globalAlpha = 1;
      g.font = SMALL;
      for (const [start, end, text, key] of lane.spans) {
        if (end < from || start > to) continue;
        const x = Math.max(at(start), -4), far = Math.max(at(end) - x - 1, 1.5);
        g.fillStyle = keyColour(key);
        g.globalAlpha = 0.85; g.beginPath(); g.roundRect(x, y + 2, far, 15, 3); g.fill(); g.globalAlpha = 1;
        if (text && g.measureText(text).width < far - 9) { g.fillStyle = "#fff"; g.fillText(text, x + 5, y + 13.5); }
      }
    },
    tell(lane, time) {
      const found = between(lane.spans, time);
      return found && [found[2] || found[3], `${seconds(found[0])} to ${seconds(found[1])}`];
    },
  },

  // Heights from 0 to 1; the higher, the stronger the colour.
  bars: {
    height: () => 34,
    draw(g, { at, from, to, y, ink, lane }) {
      const low = y + 32;
      g.font = SMALL;
      for (const [start, end, value, text] of lane.bars) {
        if (end < from || start > to) continue;
        const x = at(start), far = Math.max(at(end) - x - 1, 1), tall = 3 + 27 * value;
        g.fillStyle = ink.accent; g.globalAlpha = 0.16 + 0.74 * value;
        g.beginPath(); g.roundRect(x, low - tall, far, tall, [2.5, 2.5, 0, 0]); g.fill(); g.globalAlpha = 1;
        if (text && g.measureText(text).width < far - 2) {
          const inside = tall > 16;
          g.fillStyle = inside && value > 0.45 ? ink.raised : ink.soft;
          g.fillText(text, x + (far - g.measureText(text).width) / 2, inside ? low - 4.5 : low - tall - 3);
        }
      }
      g.fillStyle = ink.line; g.fillRect(at(from), low, at(to) - at(from), 1);
    },
    tell(lane, time) {
      const found = between(lane.bars, time);
      return found && [found[3], found[4], `${seconds(found[0])} to ${seconds(found[1])}`];
    },
  },

  curve: {
    height: () => 38,
    range(lane) {
      if (!lane.low) {
        const known = lane.values.filter((value) => value !== null).sort((a, b) => a - b);
        const low = known.length ? known[Math.floor(0.005 * known.length)] : 0, high = known.length ? known[Math.floor(0.995 * (known.length - 1))] : 1;
        Object.assign(lane, { low: low - 0.06 * (high - low), high: Math.max(high + 0.06 * (high - low), low + 1e-6) });
      }
      return [lane.low, lane.high];
    },
    name: (lane) => { const [low, high] = LANES.curve.range(lane); return `${lane.name}, ${low.toFixed(0)}–${high.toFixed(0)} ${lane.unit}`; },
    draw(g, { at, from, to, y, ink, lane }) {
      const [low, high] = this.range(lane), level = (value) => y + 36 - 33 * clamp((value - low) / (high - low), 0, 1);
      g.lineWidth = 2; g.lineCap = g.lineJoin = "round"; g.strokeStyle = ink.pitch; g.beginPath();
      let pen = false;
      for (let i = Math.max(0, Math.floor(from * lane.rate)); i <= Math.min(lane.values.length - 1, Math.ceil(to * lane.rate)); i++) {
        const value = lane.values[i];
        if (value !== null) { if (pen) g.lineTo(at(i / lane.rate), level(value)); else g.moveTo(at(i / lane.rate), level(value)); }
        pen = value !== null;
      }
      g.stroke(); g.lineCap = "butt";
    },
    tell(lane, time) {
      const value = lane.values[Math.round(time * lane.rate)];
      return [lane.name, value === null || value === undefined ? "none here" : `${value.toFixed(1)} ${lane.unit}`, seconds(time)];
    },
  },

  // Left hand above, right hand below; the shape of each phase shows its kind.
  hands: {
    height: (compact) => (compact ? 34 : 62),
    half(compact) { return (this.height(compact) - 6) / 2; },
    level(hand, y, compact) { const half = this.half(compact); return y + 3 + (hand === "left" ? 0.5 : 1.5) * half; },
    draw(g, { at, from, to, y, ink, lane, figure, compact }) {
      const half = this.half(compact);
      g.font = SMALL;
      for (const [hand, low] of [["left", y + 2 + half], ["right", y + 2 + 2 * half]]) {
        g.fillStyle = ink.line; g.fillRect(at(from), low, at(to) - at(from), 1);
        for (const [start, end, phase] of lane[hand]) {
          if (end < from || start > to) continue;
          const [a, b] = PHASES[phase] || [0.3, 0.3], x = at(start), far = at(end), tall = half - 3;
          g.fillStyle = figure.colour; g.globalAlpha = phase === "stroke" ? 0.9 : phase === "hold" ? 0.5 : 0.3;
          g.beginPath(); g.moveTo(x, low); g.lineTo(x, low - a * tall); g.lineTo(far - 0.7, low - b * tall); g.lineTo(far - 0.7, low); g.fill();
          g.globalAlpha = 1;
        }
      }
      for (const [time, size, hand, key] of lane.marks) {
        if (time < from - 1 || time > to + 1) continue;
        const x = at(time), r = (compact ? 3.2 : 4.5) + (compact ? 2 : 3) * size;
        const levels = (hand === "both" ? ["left", "right"] : [hand]).map((one) => this.level(one, y, compact));
        g.strokeStyle = ink.raised; g.lineWidth = 1.6; g.fillStyle = keyColour(key);
        if (levels.length > 1) { g.fillRect(x - 1, levels[0], 2, levels[1] - levels[0]); }
        for (const level of levels) { diamond(g, x, level, r); g.stroke(); g.fill(); }
        if (!compact) outlined(g, key, x + r + 3, levels[0] + 4, ink.ink, ink.raised);
      }
    },
    tell(lane, time, inside, tolerance, compact) {
      const hand = inside < 3 + this.half(compact) ? "left" : "right";
      const near = lane.marks.filter((mark) => Math.abs(mark[0] - time) < tolerance && (mark[2] === hand || mark[2] === "both"));
      if (near.length) {
        const [apex, size, which, key, note] = near.reduce((a, b) => (Math.abs(a[0] - time) < Math.abs(b[0] - time) ? a : b));
        return [`${key}, ${which === "both" ? "both hands" : `${which} hand`}`, `apex at ${seconds(apex)}, size ${size.toFixed(2)}`, note];
      }
      const found = between(lane[hand], time);
      return found && [`${hand} hand: ${found[2]}`, `${seconds(found[0])} to ${seconds(found[1])}, ${seconds(found[1] - found[0])} long`];
    },
  },
};

// The phases of both hands of a figure at a moment: "L hold", "R stroke · beat".
function doing(figure, time) {
  const lane = figure.tracks.find((track) => kindOf(track) === "hands");
  if (!lane) return null;
  return ["left", "right"].map((hand) => {
    const found = between(lane[hand], time), phase = found ? found[2] : "rest";
    const mark = phase === "stroke" && lane.marks.find((one) => (one[2] === hand || one[2] === "both") && one[0] >= found[0] - 0.02 && one[0] <= found[1] + 0.02);
    return { hand, phase, key: mark ? mark[3] : null };
  });
}
