// The one time bar of all walks that are shown: real elapsed time, gaps hatched, markers as ticks, the stretch
// that is played over and over, and what the charts show.

import { elapsed } from "../format.js";
import { setAttribute } from "../html.js";
import { inkOf } from "../map/ink.js";
import { timeStep } from "./lines.js";
import { LEFT } from "./plot.js";
import { watchPointer } from "./pointer.js";

const LANE_PX = 9;
const SCALE_PX = 16;
/** The charts below have a scroll bar there. */
const RIGHT = 10;

/** @typedef {{from_s: number, to_s: number, gaps: import("./clock.js").Stretch[], marks: {t_s: number, bad: boolean}[], colour: string}} Lane */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {import("./clock.js").Clock} clock
 * @param {{lanes: () => Lane[], view: () => import("./clock.js").Stretch, seek: (t_s: number) => void, select: (a_s: number, b_s: number) => void, said: () => string}} ways
 */
export function makeTimeBar(canvas, clock, ways) {
  let frame = 0;
  const span = () => Math.max(1e-3, clock.to_s - clock.from_s);
  watchPointer(canvas, {
    timeAt: (px) => clock.from_s + ((px - LEFT) / Math.max(1, canvas.clientWidth - LEFT - RIGHT)) * span(),
    seek: ways.seek,
    select: ways.select,
  });
  const sized = new ResizeObserver(draw);
  sized.observe(canvas);

  function draw() {
    if (frame === 0) frame = requestAnimationFrame(drawNow);
  }

  function drawNow() {
    frame = 0;
    const g = canvas.getContext("2d");
    const lanes = ways.lanes();
    const width = canvas.clientWidth;
    const height = SCALE_PX + Math.max(1, lanes.length) * LANE_PX + 3;
    if (!g || width === 0) return;
    canvas.style.height = `${height}px`;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    // The walk is on its way.
    if (lanes.length === 0) return;
    const ink = inkOf();
    const x = (/** @type {number} */ s) => LEFT + ((s - clock.from_s) / span()) * (width - LEFT - RIGHT);

    if (clock.loop) {
      g.globalAlpha = 0.2;
      g.fillStyle = ink.accent;
      g.fillRect(x(clock.loop[0]), 0, x(clock.loop[1]) - x(clock.loop[0]), height);
      g.globalAlpha = 1;
    }
    g.font = `11px ${ink.font}`;
    g.textBaseline = "middle";
    g.fillStyle = ink.muted;
    const step = timeStep(span(), width / 90);
    for (let s = Math.ceil(clock.from_s / step) * step; s <= clock.to_s; s += step) {
      g.fillRect(x(s), SCALE_PX - 4, 1, 4);
      g.textAlign = x(s) > width - 20 ? "right" : "center";
      g.fillText(`${s < 0 ? "−" : ""}${elapsed(Math.abs(s))}`, x(s), 6);
    }
    lanes.forEach((lane, i) => {
      const top = SCALE_PX + i * LANE_PX;
      g.fillStyle = lane.colour;
      g.globalAlpha = 0.55;
      g.fillRect(x(lane.from_s), top, Math.max(1, x(lane.to_s) - x(lane.from_s)), LANE_PX - 3);
      g.globalAlpha = 1;
      for (const gap of lane.gaps) hatch(g, x(gap[0]), top, Math.max(3, x(gap[1]) - x(gap[0])), LANE_PX - 3);
      for (const mark of lane.marks) {
        g.fillStyle = mark.bad ? ink.bad : ink.arrow;
        g.fillRect(x(mark.t_s) - 1, top - 2, 2, LANE_PX);
      }
    });
    const [a_s, b_s] = ways.view();
    if (a_s > clock.from_s || b_s < clock.to_s) {
      g.strokeStyle = ink.muted;
      g.strokeRect(x(a_s) + 0.5, SCALE_PX - 3.5, x(b_s) - x(a_s) - 1, height - SCALE_PX + 3);
    }
    g.fillStyle = ink.accent;
    g.fillRect(x(clock.t_s) - 1, 0, 2, height);
    setAttribute(canvas, "aria-valuemin", clock.from_s.toFixed(1));
    setAttribute(canvas, "aria-valuemax", clock.to_s.toFixed(1));
    setAttribute(canvas, "aria-valuenow", clock.t_s.toFixed(1));
    setAttribute(canvas, "aria-valuetext", ways.said());
  }

  /**
   * @param {CanvasRenderingContext2D} g
   * @param {number} left
   * @param {number} top
   * @param {number} width
   * @param {number} height
   */
  function hatch(g, left, top, width, height) {
    const ink = inkOf();
    g.save();
    g.beginPath();
    g.rect(left, top, width, height);
    g.clip();
    g.fillStyle = ink.ground;
    g.fillRect(left, top, width, height);
    g.strokeStyle = ink.warn;
    g.lineWidth = 1;
    g.beginPath();
    for (let px = left - height; px < left + width; px += 4) {
      g.moveTo(px, top + height);
      g.lineTo(px + height, top);
    }
    g.stroke();
    g.restore();
  }

  return {
    draw,
    close() {
      sized.disconnect();
      cancelAnimationFrame(frame);
    },
  };
}
