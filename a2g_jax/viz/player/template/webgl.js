// WebGL 2 renderer. A scene is a list of bands (rows of figures); each band is one world with its own camera.

const SUN = unit([-0.42, 1.1, 0.5]);
const SHADOW_SIZE = [2048, 1024];

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
    this.programs = {
      body: this.program(bodyVertex(false), bodyFragment(false)),
      ...(this.software ? { coarse: this.program(bodyVertex(true), bodyFragment(true)) } : {}),
      depth: this.program(DEPTH_VERTEX, EMPTY_FRAGMENT),
      spot: this.program(SPOT_VERTEX, SPOT_FRAGMENT),
      blur: this.program(BLUR_VERTEX, BLUR_FRAGMENT),
      ground: this.program(GROUND_VERTEX, GROUND_FRAGMENT),
    };
    this.meshes = [this.mesh(12, 40), this.mesh(5, 14), this.mesh(3, 10), this.mesh(2, 6)];
    this.empty = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.vertexArrays = this.meshes.map((mesh) => this.vertexArray(mesh));
    this.depthMap = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.depthMap);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, ...SHADOW_SIZE);
    this.sampling(gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL);
    this.depthTarget = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.depthTarget);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depthMap, 0);
    gl.drawBuffers([gl.NONE]);
    gl.readBuffer(gl.NONE);
    this.spots = null;
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

  // Two maps of the ground that shadows are drawn into and blurred between.
  spotMaps(width, height) {
    const gl = this.gl;
    if (this.spots && this.spots.width === width && this.spots.height === height) return this.spots;
    for (const old of this.spots ? this.spots.maps : []) { gl.deleteTexture(old.texture); gl.deleteFramebuffer(old.target); }
    const maps = [0, 1].map(() => {
      const texture = gl.createTexture(), target = gl.createFramebuffer();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
      this.sampling(gl.LINEAR);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      return { texture, target };
    });
    this.spots = { width, height, maps };
    return this.spots;
  }

  // All capsules of the band lie one after the other in one buffer; draw those of one figure.
  drawFigure(figure, fine, locate) {
    const gl = this.gl, trails = figure.count - figure.shapes;
    const parts = [[0, 0, figure.thick], [1, figure.thick, figure.shapes - figure.thick + trails]];
    for (const [detail, first, count] of parts) {
      if (count <= 0) continue;
      const chosen = this.coarse ? (fine ? 2 + detail : 3) : (fine ? detail : 1);
      gl.bindVertexArray(this.vertexArrays[chosen]);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
      for (let k = 0; k < 4; k++) gl.vertexAttribPointer(k + 1, 4, gl.FLOAT, false, STRIDE * 4, 4 * (STRIDE * (figure.offset + first) + 4 * k));
      if (locate) gl.uniform1i(locate, first);
      gl.drawElementsInstanced(gl.TRIANGLES, this.meshes[chosen].count, gl.UNSIGNED_SHORT, 0, count);
    }
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
    const gl = this.gl, theme = scene.theme;
    let total = 0;
    for (const figure of band.figures) { figure.offset = total; total += figure.count; }
    if (!this.staging || this.staging.length < total * STRIDE) this.staging = new Float32Array(total * STRIDE);
    for (const figure of band.figures) this.staging.set(figure.capsules.subarray(0, figure.count * STRIDE), figure.offset * STRIDE);
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.staging.subarray(0, total * STRIDE), gl.DYNAMIC_DRAW);
    const casters = band.figures.map((figure) => ({ ...figure, count: figure.shapes }));

    // Depth seen from the sun.
    const light = this.sunMatrix(band);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.depthTarget);
    gl.viewport(0, 0, ...SHADOW_SIZE);
    gl.disable(gl.SCISSOR_TEST); gl.disable(gl.BLEND); gl.enable(gl.DEPTH_TEST); gl.depthMask(true); gl.depthFunc(gl.LESS);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1.5, 2);
    gl.useProgram(this.programs.depth.program);
    gl.uniformMatrix4fv(this.programs.depth.at.light, false, light);
    for (const figure of casters) this.drawFigure(figure, false);
    gl.disable(gl.POLYGON_OFFSET_FILL);

    const area = this.drawSpots(band, casters);
    const view = [band.x * sx, (scene.height - band.y - band.height) * sy, band.width * sx, band.height * sy].map(Math.round);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(...view);
    gl.enable(gl.SCISSOR_TEST); gl.scissor(...view);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.drawGround(scene, band, area);

    gl.enable(gl.DEPTH_TEST); gl.depthMask(true);
    const { program, at } = this.coarse ? this.programs.coarse : this.programs.body;
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.depthMap);
    band.figures.forEach((figure, k) => {
      const ghost = scene.overlay && k > 0;
      if (ghost) {
        // A ghost is drawn over what is there, but hides its own far side: depth first, then colour once.
        gl.clear(gl.DEPTH_BUFFER_BIT);
        gl.useProgram(this.programs.depth.program);
        gl.uniformMatrix4fv(this.programs.depth.at.light, false, band.camera);
        gl.colorMask(false, false, false, false);
        this.drawFigure(figure, true);
        gl.colorMask(true, true, true, true);
        gl.enable(gl.BLEND); gl.blendEquation(gl.FUNC_ADD); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      }
      gl.useProgram(program);
      gl.depthFunc(gl.LEQUAL);
      gl.uniformMatrix4fv(at.camera, false, band.camera);
      gl.uniformMatrix4fv(at.light, false, light);
      gl.uniform1i(at.depths, 0);
      gl.uniform3fv(at.eye, band.eye); gl.uniform3fv(at.sun, SUN);
      gl.uniform3fv(at.sunColour, theme.sun); gl.uniform3fv(at.skyColour, theme.sky); gl.uniform3fv(at.bounce, theme.bounce);
      gl.uniform1f(at.alpha, ghost ? Math.max(0.32, 1 / (k + 1)) : 1); gl.uniform1f(at.texel, 1 / SHADOW_SIZE[0]); gl.uniform1f(at.floorHeight, 0);
      const shades = figure.shaders, starts = new Float32Array(56), ends = new Float32Array(56);
      shades.forEach((part, i) => {
        const o = part * STRIDE, c = figure.capsules;
        starts.set([c[o], c[o + 1], c[o + 2], 0.5 * (c[o + 3] + c[o + 7]) * Math.sqrt(c[o + 11])], 4 * i);
        ends.set([c[o + 4], c[o + 5], c[o + 6], part], 4 * i);
      });
      gl.uniform1i(at.shades, shades.length);
      gl.uniform4fv(at.shadeStart, starts); gl.uniform4fv(at.shadeEnd, ends);
      this.drawFigure(figure, true, at.first);
      gl.disable(gl.BLEND);
    });
    gl.bindVertexArray(null);
  }

  sunMatrix(band) {
    const { half, height } = band.extent, far = 6;
    const view = lookAt([SUN[0] * far, SUN[1] * far + height / 2, SUN[2] * far], [0, height / 2, 0], [0, 0, -1]);
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const x of [-half[0], half[0]]) for (const y of [0, height]) for (const z of [-half[1], half[1]]) {
      const p = [0, 1, 2].map((k) => view[k] * x + view[4 + k] * y + view[8 + k] * z + view[12 + k]);
      for (let k = 0; k < 3; k++) { low[k] = Math.min(low[k], p[k]); high[k] = Math.max(high[k], p[k]); }
    }
    return multiply(orthographic(low[0], high[0], low[1], high[1], -high[2], -low[2]), view);
  }

  drawSpots(band, casters) {
    const gl = this.gl, { half, height } = band.extent, reach = height / SUN[1];
    // Shadows fall away from the sun, so the map reaches further on that side.
    const low = [-half[0] - 0.3 - Math.max(SUN[0], 0) * reach, -half[1] - 0.3 - Math.max(SUN[2], 0) * reach];
    const high = [half[0] + 0.3 + Math.max(-SUN[0], 0) * reach, half[1] + 0.3 + Math.max(-SUN[2], 0) * reach];
    const area = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (high[0] - low[0]) / 2, (high[1] - low[1]) / 2];
    const density = Math.min(this.coarse ? 36 : 76, 1400 / (2 * area[2]));
    const { width, height: tall, maps } = this.spotMaps(Math.ceil(2 * area[2] * density), Math.ceil(2 * area[3] * density));
    const { program, at } = this.programs.spot;
    gl.bindFramebuffer(gl.FRAMEBUFFER, maps[0].target);
    gl.viewport(0, 0, width, tall);
    gl.clearColor(0, 0, 0, 1); gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND); gl.blendEquation(gl.MAX);
    gl.useProgram(program);
    gl.uniform4fv(at.area, area); gl.uniform3fv(at.sun, SUN);
    for (const above of [0, 1]) {
      gl.uniform1f(at.above, above);
      for (const figure of casters) this.drawFigure(figure, false);
    }
    gl.disable(gl.BLEND); gl.blendEquation(gl.FUNC_ADD);
    gl.useProgram(this.programs.blur.program);
    gl.bindVertexArray(this.empty);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(this.programs.blur.at.source, 0);
    for (const [from, to, x, y] of [[0, 1, 0.0224 * density / width, 0], [1, 0, 0, 0.0224 * density / tall]]) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, maps[to].target);
      gl.bindTexture(gl.TEXTURE_2D, maps[from].texture);
      gl.uniform2f(this.programs.blur.at.stride, x, y);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    return area;
  }

  drawGround(scene, band, area) {
    const gl = this.gl, theme = scene.theme, { program, at } = this.programs.ground;
    gl.useProgram(program);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.spots.maps[0].texture);
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
