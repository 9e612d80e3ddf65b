// A figure whose frames arrive one after the other: the last seconds are kept, for interpolation and trails.

class LiveFigure extends Figure {
  constructor(data, mesh) {
    super({ ...data, frames: 1 }, Float32Array.from(data.rest), 0, mesh);
    this.room = Math.ceil(3 * this.fps);
    this.first = 0;
  }

  get newest() { return (this.first + this.frames - 1) / this.fps; }

  frameAt(time) { return clamp(time * this.fps - this.first, 0, this.frames - 1); }

  // Frames from number `first` on; the very first ones take the place of the pose at rest.
  add(first, places) {
    const width = 3 * this.points, count = places.length / width;
    const old = first === 0 ? 0 : Math.min(this.frames, Math.max(0, this.room - count));
    const kept = new Float32Array((old + count) * width);
    kept.set(this.positions.subarray((this.frames - old) * width, this.frames * width));
    kept.set(places, old * width);
    this.positions = kept;
    this.frames = old + count;
    this.first = first - old;
  }
}

// The time that is shown: it advances as time does, and stays a little behind the newest frame, so that frames that
// arrive in groups, and not evenly, are shown evenly. Where it is a second late, as pictures are few, it jumps.
class Playhead {
  constructor(behind) { this.behind = behind; this.time = null; }

  advance(elapsed, newest) {
    const wanted = newest - this.behind;
    if (this.time === null || Math.abs(wanted - this.time) > 1) this.time = Math.max(0, wanted);
    const rate = 1 + clamp((wanted - this.time) * 0.8, -0.25, 0.25);
    this.time = Math.min(this.time + elapsed * rate, newest);
    return this.time;
  }
}
