// Motion data: the pose at a moment, and the capsules to draw for it.

const STRIDE = 16; // numbers of one capsule: start, radius; end, radius; axis, flatness; colour, gloss

class Figure {
  // `mesh`: an unpacked skinned mesh, drawn in place of the shapes; its bones are the axes.
  constructor(data, positions, index, mesh) {
    Object.assign(this, data);
    this.mesh = mesh ? { ...mesh, places: new Float32Array(3 * mesh.count), normals: new Float32Array(3 * mesh.count) } : null;
    this.index = index;
    this.colour = PALETTE[(data.number ?? index) % PALETTE.length];
    this.positions = positions;
    this.data = null;
    this.pose = new Float32Array(3 * this.points);
    this.axesNow = this.axes.map(() => new Float32Array(12));
    this.shapeList = this.shapes.map(([start, end, r0, r1, frame, axis, flat, shades, tint]) =>
      ({ start, end, r0, r1, frame, axis, flat, shades, tint, thin: Math.max(r0, r1) < 0.02 }));
    // Thick shapes come first: they are drawn with a finer mesh.
    this.shapeList.sort((a, b) => a.thin - b.thin);
    this.thick = this.shapeList.filter((shape) => !shape.thin).length;
    this.trailSteps = 30;
    this.capacity = this.shapeList.length + this.wrists.length * this.trailSteps;
    this.capsules = new Float32Array(this.capacity * STRIDE);
    this.shaders = this.shapeList.flatMap((shape, i) => (shape.shades ? [i] : [])).slice(0, 14);
    this.speeds = this.wristSpeeds();
  }

  frameAt(time) { return clamp(time * this.fps, 0, this.frames - 1); }

  // Position of one point in the world at a moment, linear between frames.
  at(point, time, out) {
    const f = this.frameAt(time), i = Math.floor(f), w = f - i, n = 3 * this.points;
    const a = i * n + 3 * point, b = Math.min(i + 1, this.frames - 1) * n + 3 * point, p = this.positions;
    for (let k = 0; k < 3; k++) out[k] = mix(p[a + k], p[b + k], w);
    return out;
  }

  // Speed of the faster wrist, smoothed over a tenth of a second, metres per second at each frame.
  wristSpeeds() {
    const out = new Float32Array(this.frames), n = 3 * this.points, p = this.positions, half = Math.max(1, Math.round(this.fps * 0.05));
    for (let t = 0; t < this.frames; t++) {
      const a = Math.max(t - half, 0), b = Math.min(t + half, this.frames - 1);
      for (const wrist of this.wrists) {
        const i = a * n + 3 * wrist, j = b * n + 3 * wrist;
        const far = Math.hypot(p[j] - p[i], p[j + 1] - p[i + 1], p[j + 2] - p[i + 2]);
        if (b > a) out[t] = Math.max(out[t], far * this.fps / (b - a));
      }
    }
    return out;
  }

  // Fill `capsules` for a moment. Stage coordinates: the figure's ground point at `slot`, turned by -yaw, so that
  // X is to the right of the camera and Z towards it.
  update(time, yaw, slot, theme, trails) {
    const [cx, cy, cz] = this.place.centre, turn = -yaw - this.place.heading, c = Math.cos(turn), s = Math.sin(turn), pose = this.pose;
    const stage = (x, y, z, out, o) => {
      x -= cx; z -= cz;
      out[o] = c * x + s * z + slot[0]; out[o + 1] = y - cy + slot[1]; out[o + 2] = c * z - s * x + slot[2];
    };
    const f = this.frameAt(time), i = Math.floor(f), w = f - i, n = 3 * this.points, p = this.positions;
    const a = i * n, b = Math.min(i + 1, this.frames - 1) * n;
    for (let k = 0; k < n; k += 3)
      stage(mix(p[a + k], p[b + k], w), mix(p[a + k + 1], p[b + k + 1], w), mix(p[a + k + 2], p[b + k + 2], w), pose, k);
    this.axes.forEach((axes, k) => this.orient(axes, this.axesNow[k]));
    if (this.mesh) this.skin();
    const tints = this.tints(theme);
    let o = 0;
    for (const shape of this.shapeList) {
      this.anchor(shape.start, o); this.capsules[o + 3] = shape.r0;
      this.anchor(shape.end, o + 4); this.capsules[o + 7] = shape.r1;
      for (let k = 0; k < 3; k++) this.capsules[o + 8 + k] = shape.frame < 0 ? 0 : this.axesNow[shape.frame][3 * shape.axis + k];
      this.capsules[o + 11] = shape.flat;
      this.capsules.set(tints[shape.tint] || tints.body, o + 12);
      o += STRIDE;
    }
    this.count = this.shapeList.length;
    if (trails) this.trail(time, stage, o);
  }

  // Linear blend skinning: places and normals of the mesh, from the axes of its bones.
  skin() {
    const { count, bind, facing, bones, weights, centres, places, normals } = this.mesh;
    const moves = this.moves || (this.moves = new Float32Array(12 * this.axes.length));
    this.axesNow.forEach((m, k) => {
      const o = 12 * k, x = centres[3 * k], y = centres[3 * k + 1], z = centres[3 * k + 2];
      moves.set(m, o);
      for (let i = 0; i < 3; i++) moves[o + 9 + i] -= m[i] * x + m[3 + i] * y + m[6 + i] * z;
    });
    const b = new Float32Array(12);
    for (let i = 0; i < count; i++) {
      b.fill(0);
      for (let k = 4 * i; k < 4 * i + 4; k++) {
        const w = weights[k];
        if (w === 0) continue;
        const o = 12 * bones[k];
        for (let j = 0; j < 12; j++) b[j] += w * moves[o + j];
      }
      const o = 3 * i, x = bind[o], y = bind[o + 1], z = bind[o + 2], u = facing[o], v = facing[o + 1], s = facing[o + 2];
      for (let k = 0; k < 3; k++) {
        places[o + k] = b[k] * x + b[3 + k] * y + b[6 + k] * z + b[9 + k];
        normals[o + k] = b[k] * u + b[3 + k] * v + b[6 + k] * s;
      }
    }
  }

  // What a renderer needs.
  get drawn() {
    return { capsules: this.capsules, count: this.count, shapes: this.shapeList.length, thick: this.thick, shaders: this.shaders, mesh: this.mesh };
  }

  trail(time, stage, o) {
    const colour = linear(this.colour), here = [0, 0, 0], first = o;
    for (const wrist of this.wrists) {
      for (let k = 0; k < this.trailSteps; k++) {
        const from = time - (k + 1) / this.trailSteps, to = time - k / this.trailSteps;
        if (from < 0) break;
        const r0 = 0.011 * (1 - (k + 1) / this.trailSteps), r1 = 0.011 * (1 - k / this.trailSteps);
        this.at(wrist, from, here); stage(...here, this.capsules, o); this.capsules[o + 3] = r0 + 0.001;
        this.at(wrist, to, here); stage(...here, this.capsules, o + 4); this.capsules[o + 7] = r1 + 0.001;
        this.capsules.set([0, 0, 0, 1, ...colour, -1], o + 8);
        o += STRIDE;
      }
    }
    this.count += (o - first) / STRIDE;
  }

  // Axes of a frame: Y from origin to up, X from right to left made orthogonal, Z = X x Y; then the origin.
  orient([origin, up, left, right], out) {
    const q = (k) => this.pose.subarray(3 * k, 3 * k + 3);
    const y = unit(sub(q(up), q(origin)));
    let x = sub(q(left), q(right));
    const along = dot(x, y);
    x = unit([x[0] - along * y[0], x[1] - along * y[1], x[2] - along * y[2]]);
    out.set(x, 0); out.set(y, 3); out.set(cross(x, y), 6); out.set(q(origin), 9);
  }

  anchor(anchor, o) {
    const pose = this.pose, out = this.capsules;
    if (anchor.length === 4) {
      const m = this.axesNow[anchor[0]];
      for (let k = 0; k < 3; k++) out[o + k] = m[9 + k] + anchor[1] * m[k] + anchor[2] * m[3 + k] + anchor[3] * m[6 + k];
    } else {
      const a = 3 * anchor[0], b = anchor.length === 3 ? 3 * anchor[1] : a, w = anchor.length === 3 ? anchor[2] : 0;
      for (let k = 0; k < 3; k++) out[o + k] = mix(pose[a + k], pose[b + k], w);
    }
  }

  tints(theme) {
    const body = linear(this.colour), skin = linear(theme.skin), cloth = linear(theme.cloth);
    const shade = (w) => body.map((x, k) => mix(x, cloth[k], w));
    return {
      body: [...body, 0.12], legs: [...shade(0.82), 0.08], shoe: [...shade(0.9).map((x) => 0.4 * x), 0.35],
      skin: [...body.map((x, k) => mix(x, skin[k], 0.93)), 0.16], lips: [...skin.map((x, k) => x * [0.72, 0.5, 0.48][k]), 0.2],
      hair: [...body.map((x) => 0.12 * x + 0.012), 0.3], eye: [0.012, 0.013, 0.018, 0.9],
    };
  }
}
