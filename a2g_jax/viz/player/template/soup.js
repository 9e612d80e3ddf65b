// Figures as one list of triangles, whose places are computed here. Software renderers draw every instance of a mesh on
// its own, which takes longer than its triangles; skinned meshes are drawn like this everywhere.

const VERTEX = 11; // numbers of a vertex: place, normal, colour, gloss, light of the sky

// Two caps of `rings` steps with `sides` around, joined by the tube: rows of vertices, and triangles between them. The
// first and the last row are points.
function coneTemplate(rings, sides) {
  const rows = [], indices = [];
  for (const end of [0, 1]) for (let i = 0; i <= rings; i++) rows.push([end, i / rings]);
  for (let i = 0; i + 1 < rows.length; i++)
    for (let j = 0; j < sides; j++) {
      const a = i * sides + j, b = i * sides + (j + 1) % sides;
      if (i > 0) indices.push(a, b, a + sides);
      if (i + 2 < rows.length) indices.push(a + sides, b, b + sides);
    }
  const turn = (of) => Float32Array.from({ length: sides }, (_, j) => of(2 * Math.PI * j / sides));
  const ends = Uint8Array.from(rows, ([end]) => end), steps = Float32Array.from(rows, ([, step]) => step);
  return { ends, steps, cosines: turn(Math.cos), sines: turn(Math.sin), indices, count: rows.length * sides };
}

const THICK = coneTemplate(3, 10), THIN = coneTemplate(1, 6);
const SHADE = 9; // numbers of a cone that hides the sky: start, direction to the end, squared length, radius, part

class Soup {
  constructor(gl) {
    this.gl = gl;
    this.array = gl.createVertexArray();
    this.vertices = gl.createBuffer();
    this.indices = gl.createBuffer();
    this.data = new Float32Array(0);
    this.shape = "";
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertices);
    [[0, 3, 0], [1, 3, 3], [4, 4, 6], [2, 1, 10]].forEach(([location, size, first]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 4 * VERTEX, 4 * first);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
    gl.bindVertexArray(null);
  }

  // Compute all vertices of these figures; without `cones`, of their skinned meshes alone.
  fill(figures, cones) {
    const parts = figures.map((figure) => {
      const from = figure.mesh ? figure.shapes : 0;
      return { figure, thick: cones ? Math.max(figure.thick - from, 0) : 0, from, thin: cones ? figure.count - Math.max(figure.thick, from) : 0 };
    });
    const total = parts.reduce((sum, { figure, thick, thin }) => sum + thick * THICK.count + thin * THIN.count + (figure.mesh ? figure.mesh.count : 0), 0);
    if (this.data.length < total * VERTEX) this.data = new Float32Array(Math.ceil(1.2 * total) * VERTEX);
    const shape = parts.map(({ figure, thick, thin }) => `${thick} ${thin} ${figure.mesh ? figure.mesh.id : ""}`).join();
    this.ranges = shape === this.shape ? this.ranges : this.connect(parts);
    this.shape = shape;
    let at = 0;
    for (const { figure, thick, thin, from } of parts) {
      const shades = packShades(figure);
      for (let k = 0; k < thick; k++) at = this.cone(figure.capsules, from + k, THICK, at, shades);
      if (figure.mesh) at = this.mesh(figure.mesh, at);
      const next = Math.max(figure.thick, from);
      for (let k = 0; k < thin; k++) at = this.cone(figure.capsules, next + k, THIN, at, null);
    }
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, this.data.subarray(0, at), gl.DYNAMIC_DRAW);
    this.filled = at > 0;
  }

  // Triangles, which stay the same while the parts do. Ranges of each figure: its large parts, then the others.
  connect(parts) {
    const lists = [], ranges = [];
    let base = 0, at = 0;
    const add = (indices, count) => { lists.push([indices, base]); base += count; at += indices.length; };
    for (const { figure, thick, thin } of parts) {
      const start = at;
      for (let k = 0; k < thick; k++) add(THICK.indices, THICK.count);
      if (figure.mesh) add(figure.mesh.indices, figure.mesh.count);
      const middle = at;
      for (let k = 0; k < thin; k++) add(THIN.indices, THIN.count);
      ranges.push([start, middle, at]);
    }
    const all = new Uint32Array(at);
    let next = 0;
    for (const [indices, first] of lists) for (const index of indices) all[next++] = first + index;
    const { gl } = this;
    gl.bindVertexArray(this.array);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, all, gl.DYNAMIC_DRAW);
    gl.bindVertexArray(null);
    return ranges;
  }

  // Draw figures `first` to before `stop`; `large` parts alone for shadows.
  draw(first, stop, large) {
    const { gl, ranges } = this;
    if (!this.filled || first >= stop) return;
    const draw = (from, to) => { if (to > from) gl.drawElements(gl.TRIANGLES, to - from, gl.UNSIGNED_INT, 4 * from); };
    gl.bindVertexArray(this.array);
    if (large) for (let k = first; k < stop; k++) draw(ranges[k][0], ranges[k][1]);
    else draw(ranges[first][0], ranges[stop - 1][2]);
  }

  // Vertices of a round cone, as the shader of the cones places them.
  cone(c, part, template, at, shades) {
    const o = part * STRIDE, d = this.data, ax = c[o], ay = c[o + 1], az = c[o + 2], r0 = c[o + 3], r1 = c[o + 7];
    let zx = c[o + 4] - ax, zy = c[o + 5] - ay, zz = c[o + 6] - az;
    const size = Math.hypot(zx, zy, zz);
    if (size > 1e-5) { zx /= size; zy /= size; zz /= size; } else { zx = 0; zy = 1; zz = 0; }
    let yx = c[o + 8], yy = c[o + 9], yz = c[o + 10], along = yx * zx + yy * zy + yz * zz;
    yx -= zx * along; yy -= zy * along; yz -= zz * along;
    if (yx * yx + yy * yy + yz * yz < 1e-6) {
      if (Math.abs(zy) < 0.9) { yx = -zx * zy; yy = 1 - zy * zy; yz = -zz * zy; } else { yx = 1 - zx * zx; yy = -zy * zx; yz = -zz * zx; }
    }
    const long = Math.hypot(yx, yy, yz);
    yx /= long; yy /= long; yz /= long;
    const xx = yy * zz - yz * zy, xy = yz * zx - yx * zz, xz = yx * zy - yy * zx, flat = c[o + 11];
    const contact = Math.asin(clamp((r0 - r1) / Math.max(size, 1e-5), -0.98, 0.98));
    const { ends, steps, cosines, sines } = template;
    for (let row = 0; row < ends.length; row++) {
      const end = ends[row], step = steps[row], latitude = end ? mix(contact, Math.PI / 2, step) : mix(-Math.PI / 2, contact, step);
      const wide = Math.cos(latitude), high = Math.sin(latitude), radius = end ? r1 : r0;
      const bx = ax + (end ? size * zx : 0), by = ay + (end ? size * zy : 0), bz = az + (end ? size * zz : 0);
      for (let j = 0; j < cosines.length; j++) {
        const u = wide * cosines[j], v = wide * sines[j], w = v * flat;
        const px = bx + radius * (u * xx + w * yx + high * zx), py = by + radius * (u * xy + w * yy + high * zy), pz = bz + radius * (u * xz + w * yz + high * zz);
        const s = v / flat;
        let nx = u * xx + s * yx + high * zx, ny = u * xy + s * yy + high * zy, nz = u * xz + s * yz + high * zz;
        const norm = 1 / Math.sqrt(nx * nx + ny * ny + nz * nz);
        nx *= norm; ny *= norm; nz *= norm;
        d[at] = px; d[at + 1] = py; d[at + 2] = pz; d[at + 3] = nx; d[at + 4] = ny; d[at + 5] = nz;
        d[at + 6] = c[o + 12]; d[at + 7] = c[o + 13]; d[at + 8] = c[o + 14]; d[at + 9] = c[o + 15];
        d[at + 10] = shades ? openSky(shades, part, px, py, pz, nx, ny, nz) : 1;
        at += VERTEX;
      }
    }
    return at;
  }

  mesh(mesh, at) {
    const d = this.data, { places, normals, colours } = mesh;
    for (let i = 0, k = 0, c = 0; i < mesh.count; i++, k += 3, c += 4) {
      d[at] = places[k]; d[at + 1] = places[k + 1]; d[at + 2] = places[k + 2];
      d[at + 3] = normals[k]; d[at + 4] = normals[k + 1]; d[at + 5] = normals[k + 2];
      d[at + 6] = colours[c]; d[at + 7] = colours[c + 1]; d[at + 8] = colours[c + 2]; d[at + 9] = colours[c + 3];
      d[at + 10] = 1;
      at += VERTEX;
    }
    return at;
  }
}

// The cones of a figure that hide the sky.
function packShades(figure) {
  const c = figure.capsules, out = new Float32Array(SHADE * figure.shaders.length);
  figure.shaders.forEach((part, i) => {
    const o = part * STRIDE, x = c[o + 4] - c[o], y = c[o + 5] - c[o + 1], z = c[o + 6] - c[o + 2];
    const radius = 0.5 * (c[o + 3] + c[o + 7]) * Math.sqrt(c[o + 11]);
    out.set([c[o], c[o + 1], c[o + 2], x, y, z, Math.max(x * x + y * y + z * z, 1e-8), radius, part], SHADE * i);
  });
  return out;
}

// Share of the sky's light that reaches a place, as `occlusion` of the shader has it.
function openSky(shades, part, px, py, pz, nx, ny, nz) {
  let open = 1;
  for (let i = 0; i < shades.length; i += SHADE) {
    const r = shades[i + 7], x = shades[i + 3], y = shades[i + 4], z = shades[i + 5];
    const fx = shades[i] - px, fy = shades[i + 1] - py, fz = shades[i + 2] - pz;
    const along = -(fx * x + fy * y + fz * z) / shades[i + 6], h = along < 0 ? 0 : along > 1 ? 1 : along;
    const dx = fx + h * x, dy = fy + h * y, dz = fz + h * z, away = dx * dx + dy * dy + dz * dz;
    if (away > 25 * r * r || shades[i + 8] === part) continue;
    const far = Math.max(Math.sqrt(away), 0.8 * r), facing = (dx * nx + dy * ny + dz * nz) / far;
    if (facing > 0) open *= 1 - 0.85 * Math.min(facing * r * r / (far * far), 1);
  }
  return open;
}
