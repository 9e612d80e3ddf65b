// WebGL 2 renderer. A scene is a list of bands (rows of figures); each band is one world with its own camera.

class WebGLRenderer {
  static create(canvas) {
    // Ask a throwaway canvas who draws: multisampling is chosen when a context is made, and too slow in software.
    const probe = document.createElement("canvas").getContext("webgl2");
    if (!probe) return null;
    let name = probe.getParameter(probe.RENDERER);
    const more = name === "WebKit WebGL" && probe.getExtension("WEBGL_debug_renderer_info");
    if (more) name = probe.getParameter(more.UNMASKED_RENDERER_WEBGL);
    const software = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name), drop = probe.getExtension("WEBGL_lose_context");
    if (drop) drop.loseContext();
    const gl = canvas.getContext("webgl2", { antialias: !software, alpha: false, powerPreference: "high-performance" });
    return gl ? new WebGLRenderer(canvas, gl, software) : null;
  }

  constructor(canvas, gl, software) {
    this.canvas = canvas;
    this.gl = gl;
    this.software = software;
    this.name = "webgl2";
    this.scale = software ? 0.75 : 1;
    this.build();
    canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); this.lost = true; });
    canvas.addEventListener("webglcontextrestored", () => { this.lost = false; this.build(); });
  }

  build() {
    const gl = this.gl;
    const kinds = (given) => ({
      body: this.program(bodyVertex(given), bodyFragment(given, given && this.software ? 1 : 4)),
      depth: this.program(depthVertex(given), EMPTY_FRAGMENT),
      spot: this.program(spotVertex(given), SPOT_FRAGMENT),
    });
    this.cones = kinds(false);
    this.given = kinds(true);
    this.programs = { blur: this.program(BLUR_VERTEX, BLUR_FRAGMENT), ground: this.program(GROUND_VERTEX, GROUND_FRAGMENT) };
    this.soup = new Soup(gl);
    this.meshes = [this.mesh(12, 40), this.mesh(5, 14)];
    this.empty = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.vertexArrays = this.meshes.map((mesh) => this.vertexArray(mesh));
    this.shadows = new Shadows(this);
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    const places = {};
    for (let i = 0; i < (gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) || 0); i++) {
      const name = gl.getActiveUniform(program, i).name;
      places[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, at: places };
  }

  // Two caps of `rings` steps with `sides` around, joined by the tube.
  mesh(rings, sides) {
    const gl = this.gl, vertices = [], indices = [], rows = [];
    for (const end of [0, 1]) for (let i = 0; i <= rings; i++) rows.push([end, i / rings]);
    for (const [end, latitude] of rows)
      for (let j = 0; j <= sides; j++) vertices.push(end, latitude, Math.cos(2 * Math.PI * j / sides), Math.sin(2 * Math.PI * j / sides));
    for (let i = 0; i + 1 < rows.length; i++)
      for (let j = 0; j < sides; j++) {
        const a = i * (sides + 1) + j, b = a + sides + 1;
        indices.push(a, a + 1, b, b, a + 1, b + 1);
      }
    const made = { vertices: gl.createBuffer(), indices: gl.createBuffer(), count: indices.length };
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, made.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
    return made;
  }

  vertexArray(mesh) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
    for (let k = 1; k <= 4; k++) { gl.enableVertexAttribArray(k); gl.vertexAttribDivisor(k, 1); }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    gl.bindVertexArray(null);
    return array;
  }

  sampling(filter) {
    const gl = this.gl;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }

  // All cones of the band lie one after the other in one buffer; draw those of one figure. A skinned mesh takes the place
  // of the body's.
  drawCones(figure, fine, locate) {
    const gl = this.gl, body = figure.mesh ? figure.shapes : 0, thick = Math.max(figure.thick, body);
    const parts = [[0, body, thick - body], [1, thick, figure.count - thick]];
    for (const [detail, first, count] of parts) {
      if (count <= 0) continue;
      const chosen = fine ? detail : 1;
      gl.bindVertexArray(this.vertexArrays[chosen]);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
      for (let k = 0; k < 4; k++) gl.vertexAttribPointer(k + 1, 4, gl.FLOAT, false, STRIDE * 4, 4 * (STRIDE * (figure.offset + first) + 4 * k));
      if (locate) gl.uniform1i(locate, first);
      gl.drawElementsInstanced(gl.TRIANGLES, this.meshes[chosen].count, gl.UNSIGNED_SHORT, 0, count);
    }
  }

  // Draw some of the band's figures with the programs of one kind, `body`, `depth` or `spot`, of cones and of given places.
  pass(kind, figures, fine, set) {
    const gl = this.gl;
    if (!this.coarse) {
      const { program, at } = this.cones[kind];
      gl.useProgram(program);
      set(at);
      for (const figure of figures) {
        if (at.shades) this.shade(at, figure);
        this.drawCones(figure, fine, at.first);
      }
    }
    if (!this.soup.filled) return;
    const { program, at } = this.given[kind];
    gl.useProgram(program);
    set(at);
    const first = figures[0].order;
    this.soup.draw(first, first + figures.length, this.coarse && !fine);
  }

  // The cones of a figure that hide the sky.
  shade(at, { capsules: c, shaders }) {
    const gl = this.gl, starts = new Float32Array(56), ends = new Float32Array(56);
    shaders.forEach((part, i) => {
      const o = part * STRIDE;
      starts.set([c[o], c[o + 1], c[o + 2], 0.5 * (c[o + 3] + c[o + 7]) * Math.sqrt(c[o + 11])], 4 * i);
      ends.set([c[o + 4], c[o + 5], c[o + 6], part], 4 * i);
    });
    gl.uniform1i(at.shades, shaders.length);
    gl.uniform4fv(at.shadeStart, starts); gl.uniform4fv(at.shadeEnd, ends);
  }

  render(scene) {
    if (this.lost) return;
    const gl = this.gl, canvas = this.canvas;
    const width = Math.max(1, Math.round(scene.width * scene.ratio * this.scale)), height = Math.max(1, Math.round(scene.height * scene.ratio * this.scale));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    // Software renderers draw a simpler picture while it moves.
    this.coarse = this.software && !scene.still;
    gl.disable(gl.CULL_FACE);
    for (const band of scene.bands) this.renderBand(scene, band, width / scene.width, height / scene.height);
  }

  renderBand(scene, band, sx, sy) {
    const gl = this.gl;
    let total = 0;
    band.figures.forEach((figure, k) => { Object.assign(figure, { order: k, offset: total }); total += figure.count; });
    gl.bindVertexArray(null);
    if (!this.coarse) {
      if (!this.staging || this.staging.length < total * STRIDE) this.staging = new Float32Array(total * STRIDE);
      for (const figure of band.figures) this.staging.set(figure.capsules.subarray(0, figure.count * STRIDE), figure.offset * STRIDE);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
      gl.bufferData(gl.ARRAY_BUFFER, this.staging.subarray(0, total * STRIDE), gl.DYNAMIC_DRAW);
    }
    this.soup.fill(band.figures, this.coarse);
    const casters = band.figures.map((figure) => ({ ...figure, count: figure.shapes }));
    // Cones and most meshes are closed, and their far sides need no drawing.
    if (this.coarse && !band.figures.some((figure) => figure.mesh?.open)) gl.enable(gl.CULL_FACE); else gl.disable(gl.CULL_FACE);

    const { light, area } = this.shadows.cast(band, casters, scene.bands.length === 1);
    const view = [band.x * sx, (scene.height - band.y - band.height) * sy, band.width * sx, band.height * sy].map(Math.round);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(...view);
    gl.enable(gl.SCISSOR_TEST); gl.scissor(...view);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.drawGround(scene, band, area);

    gl.enable(gl.DEPTH_TEST); gl.depthMask(true);
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.shadows.depthMap);
    if (!scene.overlay) this.drawBodies(scene, band, band.figures, light, 1);
    else band.figures.forEach((figure, k) => this.drawBodies(scene, band, [figure], light, k > 0 ? Math.max(0.32, 1 / (k + 1)) : 1));
    gl.disable(gl.CULL_FACE);
    gl.bindVertexArray(null);
  }

  drawBodies(scene, band, figures, light, alpha) {
    const gl = this.gl, theme = scene.theme;
    if (alpha < 1) {
      // A ghost is drawn over what is there, but hides its own far side: depth first, then colour once.
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.colorMask(false, false, false, false);
      this.pass("depth", figures, true, (at) => gl.uniformMatrix4fv(at.light, false, band.camera));
      gl.colorMask(true, true, true, true);
      gl.enable(gl.BLEND); gl.blendEquation(gl.FUNC_ADD); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    }
    gl.depthFunc(gl.LEQUAL);
    this.pass("body", figures, true, (at) => {
      gl.uniformMatrix4fv(at.camera, false, band.camera);
      gl.uniformMatrix4fv(at.light, false, light);
      gl.uniform1i(at.depths, 0);
      gl.uniform3fv(at.eye, band.eye); gl.uniform3fv(at.sun, SUN);
      gl.uniform3fv(at.sunColour, theme.sun); gl.uniform3fv(at.skyColour, theme.sky); gl.uniform3fv(at.bounce, theme.bounce);
      gl.uniform1f(at.alpha, alpha); gl.uniform1f(at.floorHeight, 0);
      if (at.texel) gl.uniform1f(at.texel, 1 / SHADOW_SIZE[0]);
    });
    gl.disable(gl.BLEND);
  }

  drawGround(scene, band, area) {
    const gl = this.gl, theme = scene.theme, { program, at } = this.programs.ground;
    gl.useProgram(program);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.shadows.spots.maps[0].texture);
    gl.uniform1i(at.spots, 0);
    gl.uniformMatrix4fv(at.back, false, band.inverse);
    gl.uniform3fv(at.eye, band.eye); gl.uniform4fv(at.area, area);
    for (const name of ["top", "horizon", "groundA", "groundB", "shadowTint"]) gl.uniform3fv(at[name], linear(theme[name]));
    gl.uniform2f(at.turn, Math.cos(scene.yaw), Math.sin(scene.yaw));
    gl.uniform2f(at.strength, theme.shadow, theme.contact);
    gl.uniform1f(at.fade, 5 + 1.6 * band.extent.half[0]);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
