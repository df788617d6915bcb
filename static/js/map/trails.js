// Where people have walked, on two canvases: the past, faint and drawn seldom, and the last minute, strong
// and drawn with every move. Hours of trails of many people so cost no more than their last steps.

import { firstAt } from "../state/trail.js";

/** @typedef {{session: import("../state/live.js").LiveSession, colour: number, selected: boolean}} Walked */

/** The recent part begins this long before the end when the past is drawn … */
const RECENT_NS = 60e9;
/** … and the past is drawn again when it has grown to this. */
const RECENT_MOST_NS = 90e9;

export class Trails {
  /** @param {() => {walked: Walked[], seconds: number}} content */
  constructor(content) {
    this.content = content;
    /** Where each session's past ends, ns. @type {Map<string, number>} */
    this.splits = new Map();
  }

  /** Whether the past has to be drawn again: the recent part has grown long, or a revision reaches behind it. */
  pastIsStale() {
    return this.content().walked.some(({ session }) => {
      const split = this.splits.get(session.id);
      if (session.trail.length === 0) return false;
      return split === undefined || end(session) - split > RECENT_MOST_NS || session.revised_from_ns < split;
    });
  }

  /** @type {import("./canvas.js").Draw} */
  drawPast = (g, paper) => {
    const { walked, seconds } = this.content();
    this.splits.clear();
    for (const { session, colour, selected } of walked) {
      if (session.trail.length === 0) continue;
      const split = end(session) - RECENT_NS;
      this.splits.set(session.id, split);
      session.revised_from_ns = Infinity;
      // A line of one pixel is drawn six times as fast as a wider one, and fifty pasts are half an hour long each.
      pen(g, paper.ink.people[colour], selected ? 3 : 1, selected ? 0.6 : 0.62);
      // The first recent point closes the gap between the two canvases.
      line(
        g,
        paper,
        session.trail,
        firstAt(session.trail, end(session) - seconds * 1e9),
        firstAt(session.trail, split) + 1,
      );
    }
    g.globalAlpha = 1;
  };

  /** @type {import("./canvas.js").Draw} */
  drawRecent = (g, paper) => {
    for (const { session, colour, selected } of this.content().walked) {
      if (session.trail.length === 0) continue;
      const split = this.splits.get(session.id) ?? end(session) - RECENT_NS;
      pen(g, paper.ink.people[colour], selected ? 3 : 2, selected ? 1 : 0.85);
      line(g, paper, session.trail, firstAt(session.trail, split), session.trail.length);
    }
    g.globalAlpha = 1;
  };
}

/** @param {import("../state/live.js").LiveSession} session */
function end(session) {
  return session.trail[session.trail.length - 1][0];
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {string} colour
 * @param {number} width
 * @param {number} alpha
 */
function pen(g, colour, width, alpha) {
  g.lineCap = g.lineJoin = "round";
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.globalAlpha = alpha;
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas.js").Paper} paper
 * @param {import("../state/trail.js").TrailPoint[]} trail
 * @param {number} from
 * @param {number} to
 */
function line(g, { x, y }, trail, from, to) {
  g.beginPath();
  let [lastX, lastY] = [NaN, NaN];
  for (let i = from; i < to && i < trail.length; i++) {
    const [px, py] = [x(trail[i][1]), y(trail[i][2])];
    // Points closer than a pixel and a half to the last one drawn would not be seen.
    if (Math.abs(px - lastX) < 1.5 && Math.abs(py - lastY) < 1.5 && i !== to - 1) continue;
    if (i === from) g.moveTo(px, py);
    else g.lineTo(px, py);
    [lastX, lastY] = [px, py];
  }
  g.stroke();
}
