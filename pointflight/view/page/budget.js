// How many surfels a frame may have so that frames come often enough on this machine.
const LEAST = 40_000;
const MOST = 6_000_000;

export class FrameBudget {
  // Surfels to begin with; ms between frames above which there are to be fewer, below which more.
  constructor(start, slow, fast) {
    Object.assign(this, { slow, fast });
    this.surfels = Math.max(LEAST, start);
    this.isAutomatic = true;
    this.interval = 0; // ms between frames, smoothed
    this.since = 0;
    this.frames = 0;
  }

  // Once per frame, with when it began (ms). True if the budget changed.
  frame(now, map) {
    if (document.hidden || this.since === 0) {
      this.since = now;
      this.frames = 0;
      return false;
    }
    ++this.frames;
    if (now - this.since < 1000) return false;
    this.interval = (now - this.since) / this.frames;
    this.since = now;
    this.frames = 0;
    if (!this.isAutomatic) return false;
    const before = this.surfels;
    const { drawn } = map;
    if (this.interval > this.slow) this.surfels = Math.max(LEAST, 0.7 * Math.min(this.surfels, drawn));
    else if (this.interval < this.fast && drawn > 0.7 * this.surfels) this.surfels = Math.min(MOST, 1.3 * this.surfels);
    return this.surfels !== before;
  }
}
