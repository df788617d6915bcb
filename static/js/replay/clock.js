// The time that is looked at, and how it runs: real elapsed time, faster or slower, over gaps or around a
// stretch. It knows no screen; the screen calls `advance` with the seconds that have really passed.

export const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32, 64];

/** @typedef {[from_s: number, to_s: number]} Stretch */

export class Clock {
  constructor() {
    this.from_s = 0;
    this.to_s = 0;
    this.t_s = 0;
    /** @type {"paused" | "playing" | "live"} live: the newest moment of a walk that goes on */
    this.state = "paused";
    this.speed = 4;
    this.skipGaps = true;
    /** @type {Stretch[]} without data, by time, apart from each other */
    this.gaps = [];
    /** @type {Stretch | null} */
    this.loop = null;
  }

  /**
   * @param {number} from_s
   * @param {number} to_s
   */
  setSpan(from_s, to_s) {
    this.from_s = from_s;
    this.to_s = Math.max(from_s, to_s);
    if (this.state === "live") this.t_s = this.to_s;
    else this.seek(this.t_s);
  }

  /** @param {number} t_s */
  seek(t_s) {
    this.t_s = Math.min(this.to_s, Math.max(this.from_s, t_s));
    // Looking back at a walk that goes on leaves its newest moment.
    if (this.state === "live" && this.t_s < this.to_s) this.state = "paused";
  }

  /** Play or pause. In a live walk it holds the picture; it never jumps. */
  toggle() {
    if (this.state !== "paused") this.state = "paused";
    else {
      const [from_s, to_s] = this.loop ?? [this.from_s, this.to_s];
      if (this.t_s >= to_s) this.t_s = from_s;
      this.state = "playing";
    }
  }

  goLive() {
    this.t_s = this.to_s;
    this.state = "live";
  }

  /** @param {number} by 1: the next faster one, −1: the next slower one */
  changeSpeed(by) {
    const at = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + by))];
  }

  /**
   * A stretch to play over and over; null plays on to the end.
   * @param {number | null} a_s
   * @param {number} [b_s]
   */
  setLoop(a_s, b_s = 0) {
    if (a_s === null) {
      this.loop = null;
      return;
    }
    const inside = (/** @type {number} */ s) => Math.min(this.to_s, Math.max(this.from_s, s));
    const [from_s, to_s] = [inside(Math.min(a_s, b_s)), inside(Math.max(a_s, b_s))];
    this.loop = to_s > from_s ? [from_s, to_s] : null;
  }

  /**
   * Time has passed: moves on while playing.
   * @param {number} passed_s
   * @returns {boolean} whether it moved
   */
  advance(passed_s) {
    if (this.state !== "playing") return false;
    const before_s = this.t_s;
    const [from_s, to_s] = this.loop ?? [this.from_s, this.to_s];
    let t_s = this.t_s + passed_s * this.speed;
    // A gap is entered or begun in: on at its other end, with what is left of the step.
    if (this.skipGaps) {
      for (const [a_s, b_s] of this.gaps) if (t_s > a_s && before_s < b_s) t_s += b_s - Math.max(a_s, before_s);
    }
    if (t_s >= to_s) {
      if (this.loop) t_s = from_s + ((t_s - to_s) % (to_s - from_s));
      else {
        t_s = to_s;
        this.state = "paused";
      }
    }
    this.t_s = t_s;
    return this.t_s !== before_s;
  }
}

/**
 * Where a track has no points for longer than it should.
 * @param {ArrayLike<number>} t_s
 * @param {number} longest_s
 * @returns {Stretch[]}
 */
export function gapsOf(t_s, longest_s) {
  /** @type {Stretch[]} */
  const gaps = [];
  for (let i = 1; i < t_s.length; i++) if (t_s[i] - t_s[i - 1] > longest_s) gaps.push([t_s[i - 1], t_s[i]]);
  return gaps;
}

/**
 * What is in every one of these lists: time in which nobody has data.
 * @param {Stretch[][]} lists
 * @returns {Stretch[]}
 */
export function inAll(lists) {
  return lists.reduce((all, list) =>
    all.flatMap(([a, b]) =>
      list.flatMap(([c, d]) =>
        Math.max(a, c) < Math.min(b, d) ? [/** @type {Stretch} */ ([Math.max(a, c), Math.min(b, d)])] : [],
      ),
    ),
  );
}
