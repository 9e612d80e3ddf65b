// Shadows: the depth from the sun, and maps of the ground.

const SUN = unit([-0.42, 1.1, 0.5]);
const SHADOW_SIZE = [2048, 1024];
const QUARTER = [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0, -0.5, -0.5, 0, 1]; // clip space to its lower left quarter
const RECENT = 150; // milliseconds that shadows may be old

class Shadows {
  constructor(renderer) {
    this.renderer = renderer;
    this.gl = renderer.gl;
    const { gl } = this;
    this.depthMap = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.depthMap);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, ...SHADOW_SIZE);
    renderer.sampling(gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL);
    this.depthTarget = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.depthTarget);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depthMap, 0);
    gl.drawBuffers([gl.NONE]);
    gl.readBuffer(gl.NONE);
    this.spots = this.last = null;
  }

  // Draw the shadows of a band's figures; returns the matrix of the sun, and the part of the ground that its map has.
  // Moving pictures of software renderers that have `one` band have new shadows every other time.
  cast(band, casters, one) {
    const { coarse } = this.renderer, last = this.last, now = performance.now();
    this.last = null;
    if (coarse && one && last && last.count === casters.length && now - last.made < RECENT) return last;
    const cast = { light: this.depth(band, casters, coarse), area: this.drawSpots(band, casters, coarse), count: casters.length, made: now };
    if (coarse && one) this.last = cast;
    return cast;
  }

  // Depth from the sun; a moving picture of software renderers uses a quarter of the map.
  depth(band, casters, coarse) {
    const { gl } = this, light = coarse ? multiply(QUARTER, this.sunMatrix(band)) : this.sunMatrix(band);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.depthTarget);
    gl.viewport(0, 0, ...SHADOW_SIZE);
    gl.disable(gl.BLEND); gl.enable(gl.DEPTH_TEST); gl.depthMask(true); gl.depthFunc(gl.LESS);
    if (coarse) { gl.enable(gl.SCISSOR_TEST); gl.scissor(0, 0, SHADOW_SIZE[0] / 2, SHADOW_SIZE[1] / 2); } else gl.disable(gl.SCISSOR_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1.5, 2);
    this.renderer.pass("depth", casters, false, (at) => gl.uniformMatrix4fv(at.light, false, light));
    gl.disable(gl.POLYGON_OFFSET_FILL); gl.disable(gl.SCISSOR_TEST);
    return light;
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

  // Two maps of the ground that shadows are drawn into and blurred between.
  spotMaps(width, height) {
    const gl = this.gl;
    if (this.spots && this.spots.width === width && this.spots.height === height) return this.spots;
    for (const old of this.spots ? this.spots.maps : []) { gl.deleteTexture(old.texture); gl.deleteFramebuffer(old.target); }
    const maps = [0, 1].map(() => {
      const texture = gl.createTexture(), target = gl.createFramebuffer();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
      this.renderer.sampling(gl.LINEAR);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      return { texture, target };
    });
    this.spots = { width, height, maps };
    return this.spots;
  }

  drawSpots(band, casters, coarse) {
    const gl = this.gl, { half, height } = band.extent, reach = height / SUN[1];
    // Shadows fall away from the sun, so the map reaches further on that side.
    const low = [-half[0] - 0.3 - Math.max(SUN[0], 0) * reach, -half[1] - 0.3 - Math.max(SUN[2], 0) * reach];
    const high = [half[0] + 0.3 + Math.max(-SUN[0], 0) * reach, half[1] + 0.3 + Math.max(-SUN[2], 0) * reach];
    const area = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (high[0] - low[0]) / 2, (high[1] - low[1]) / 2];
    const density = Math.min(coarse ? 36 : 76, 1400 / (2 * area[2]));
    const { width, height: tall, maps } = this.spotMaps(Math.ceil(2 * area[2] * density), Math.ceil(2 * area[3] * density));
    gl.bindFramebuffer(gl.FRAMEBUFFER, maps[0].target);
    gl.viewport(0, 0, width, tall);
    gl.clearColor(0, 0, 0, 1); gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND); gl.blendEquation(gl.MAX);
    for (const above of [0, 1])
      this.renderer.pass("spot", casters, false, (at) => { gl.uniform4fv(at.area, area); gl.uniform3fv(at.sun, SUN); gl.uniform1f(at.above, above); });
    gl.disable(gl.BLEND); gl.blendEquation(gl.FUNC_ADD);
    gl.useProgram(this.renderer.programs.blur.program);
    gl.bindVertexArray(this.renderer.empty);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(this.renderer.programs.blur.at.source, 0);
    for (const [from, to, x, y] of [[0, 1, 0.0224 * density / width, 0], [1, 0, 0, 0.0224 * density / tall]]) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, maps[to].target);
      gl.bindTexture(gl.TEXTURE_2D, maps[from].texture);
      gl.uniform2f(this.renderer.programs.blur.at.stride, x, y);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    return area;
  }
}
