// The same picture, plainer, for browsers without WebGL 2: capsules as filled outlines, far ones first.

class CanvasRenderer {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.name = "canvas2d";
    this.scale = 1;
    this.software = false;
  }

  render(scene) {
    const { canvas, context: g } = this, ratio = Math.min(scene.ratio, 2) * this.scale;
    const width = Math.max(1, Math.round(scene.width * ratio)), height = Math.max(1, Math.round(scene.height * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    g.setTransform(width / scene.width, 0, 0, height / scene.height, 0, 0);
    for (const band of scene.bands) {
      g.save();
      g.beginPath(); g.rect(band.x, band.y, band.width, band.height); g.clip();
      this.ground(scene, band);
      band.figures.forEach((figure) => this.shadow(scene, band, figure));
      band.figures.forEach((figure, k) => {
        g.globalAlpha = scene.overlay && k > 0 ? 0.55 : 1;
        this.figure(band, figure);
        g.globalAlpha = 1;
      });
      g.restore();
    }
  }

  ground(scene, band) {
    const g = this.context, theme = scene.theme, { x, y, width, height } = band;
    const horizon = clamp(onScreen(band, [0, 0, -60])[1], y, y + height), sky = g.createLinearGradient(0, y, 0, Math.max(horizon, y + 1));
    sky.addColorStop(0, theme.top); sky.addColorStop(1, theme.horizon);
    g.fillStyle = sky; g.fillRect(x, y, width, height);
    const size = 0.5, reach = Math.ceil((3 + 1.3 * band.extent.half[0]) / size), c = Math.cos(scene.yaw), s = Math.sin(scene.yaw);
    const place = (i, k) => onScreen(band, [(c * i - s * k) * size, 0, (s * i + c * k) * size]);
    for (let i = -reach; i < reach; i++)
      for (let k = -reach; k < reach; k++) {
        const corners = [place(i, k), place(i + 1, k), place(i + 1, k + 1), place(i, k + 1)];
        if (corners.some((p) => p[2] < 0.1)) continue;
        g.globalAlpha = Math.exp(-Math.pow(Math.hypot(i, k) / reach * 1.5, 2));
        g.fillStyle = (i + k) & 1 ? theme.groundA : theme.groundB;
        g.beginPath(); corners.forEach((p) => g.lineTo(p[0], p[1])); g.closePath(); g.fill();
      }
    g.globalAlpha = 1;
  }

  shadow(scene, band, figure) {
    const g = this.context, c = figure.capsules;
    g.fillStyle = display(linear(scene.theme.shadowTint), 0.16);
    g.beginPath();
    const fall = (o) => [c[o] - SUN[0] * c[o + 1] / SUN[1], 0, c[o + 2] - SUN[2] * c[o + 1] / SUN[1]];
    for (let i = 0; i < figure.shapes; i++) {
      const o = i * STRIDE, a = onScreen(band, fall(o)), b = onScreen(band, fall(o + 4));
      this.outline(a, b, c[o + 3] * band.metre * 0.9, c[o + 7] * band.metre * 0.9);
    }
    g.fill("nonzero");
  }

  figure(band, figure) {
    const g = this.context, c = figure.capsules, parts = [];
    for (let i = 0; i < figure.count; i++) {
      const o = i * STRIDE, a = onScreen(band, [c[o], c[o + 1], c[o + 2]]), b = onScreen(band, [c[o + 4], c[o + 5], c[o + 6]]);
      const r = Math.max(c[o + 3], c[o + 7]);
      // Small parts lie on large ones (visor, nose, fingers): they come after what they touch.
      parts.push({ o, a, b, depth: (a[2] + b[2]) / 2 - r - (r < 0.025 ? 0.03 : 0) });
    }
    parts.sort((p, q) => q.depth - p.depth);
    const focal = band.height / (2 * Math.tan(FIELD / 2));
    for (const { o, a, b } of parts) {
      if (a[2] < 0.1 || b[2] < 0.1) continue;
      const ra = c[o + 3] * focal / a[2], rb = c[o + 7] * focal / b[2], r = Math.max(ra, rb), base = [c[o + 12], c[o + 13], c[o + 14]];
      const x = (a[0] + b[0]) / 2, y = (a[1] + b[1]) / 2, spread = r + Math.hypot(a[0] - b[0], a[1] - b[1]) / 2;
      const paint = g.createLinearGradient(x - 0.5 * spread, y - 0.8 * spread, x + 0.5 * spread, y + 0.8 * spread);
      paint.addColorStop(0, display(base.map((k) => 1.12 * k + 0.04)));
      paint.addColorStop(1, display(base.map((k) => 0.55 * k)));
      g.fillStyle = c[o + 15] < 0 ? display(base) : paint;
      g.beginPath(); this.outline(a, b, ra, rb); g.fill();
    }
  }

  // Two circles and their outer tangents.
  outline(a, b, ra, rb) {
    const g = this.context, dx = b[0] - a[0], dy = b[1] - a[1], far = Math.hypot(dx, dy);
    if (far <= Math.abs(ra - rb) + 1e-3) {
      const big = ra > rb ? a : b;
      g.moveTo(big[0] + Math.max(ra, rb), big[1]);
      g.arc(big[0], big[1], Math.max(ra, rb), 0, 2 * Math.PI);
      return;
    }
    const turn = Math.atan2(dy, dx), lean = Math.acos(clamp((ra - rb) / far, -1, 1));
    g.moveTo(a[0] + ra * Math.cos(turn + lean), a[1] + ra * Math.sin(turn + lean));
    g.arc(a[0], a[1], ra, turn + lean, turn - lean + 2 * Math.PI);
    g.arc(b[0], b[1], rb, turn - lean, turn + lean);
    g.closePath();
  }
}

// WebGL 2 where it works and is wanted, else a 2D canvas.
function makeRenderer(canvas, wanted) {
  if (!wanted) return new CanvasRenderer(canvas);
  try {
    return WebGLRenderer.create(canvas) || new CanvasRenderer(canvas);
  } catch (error) {
    console.warn("WebGL 2 failed, drawing without it:", error.message);
    const fresh = canvas.cloneNode(true);
    canvas.replaceWith(fresh);
    return new CanvasRenderer(fresh);
  }
}
