// When the next picture is drawn, and in how many pixels: drawing leaves time for messages, sound and the server.

const SHARE = 0.6; // of the time is spent on drawing at most
const SLOW = 0.15, QUICK = 0.08; // seconds a picture, beyond which it gets fewer pixels, and below which it gets more
const LEAST_SCALE = 0.55; // of the usual pixels, in each direction

class Pace {
  constructor(renderer) {
    this.renderer = renderer;
    this.full = renderer.scale;
    this.cost = 0; // seconds a picture
    this.sized = performance.now() + 2000; // the first pictures compile programs
  }

  // Draws, and calls `then` when the picture is complete and the next one may begin: there is never a queue of pictures.
  picture(draw, then) {
    const began = performance.now();
    draw();
    const { gl } = this.renderer, fence = gl && !this.renderer.lost ? gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0) : null;
    if (fence) gl.flush();
    const look = () => {
      const now = performance.now();
      if (fence && !gl.isContextLost() && now - began < 5000 && gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) { setTimeout(look, 4); return; }
      if (fence) gl.deleteSync(fence);
      const rest = this.measure((now - began) / 1000, now);
      if (rest > 0.004) setTimeout(then, 1000 * rest); else then();
    };
    if (fence) setTimeout(look, 1); else look();
  }

  // Seconds until the next picture. Pictures become fewer first, and then smaller.
  measure(taken, now) {
    this.cost = this.cost ? mix(this.cost, taken, 0.3) : taken;
    if (now - this.sized > 1000) {
      const scale = this.renderer.scale, least = this.full * LEAST_SCALE;
      let wanted = scale;
      if (this.cost > SLOW) wanted = Math.max(least, scale * clamp(Math.sqrt(SLOW / this.cost), 0.6, 0.95));
      else if (this.cost < QUICK) wanted = Math.min(this.full, 1.1 * scale);
      if (wanted !== scale) { this.renderer.scale = wanted; this.sized = now; }
    }
    return taken < 0.02 ? 0 : Math.min(taken * (1 / SHARE - 1), 0.3);
  }
}
