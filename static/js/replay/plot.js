// One chart on a canvas. Of every step in time the smallest and largest value are drawn, so no peak is lost
// however far the picture is zoomed out.

import { inkNamed, inkOf } from "../map/ink.js";
import { extremes, ticks, wrapDegrees } from "./lines.js";

/**
 * @typedef {import("./lines.js").Line} Line
 * @typedef {{t_s: number, value: number, bad?: boolean}} Dot
 * @typedef {{
 *   plot: import("./plots.js").Plot, line: (chart: string, series: string) => Line | undefined,
 *   limits: import("./lines.js").Limit[], dots: Dot[], from_s: number, to_s: number,
 * }} Picture
 */

/** Room for the figures at the left and the labels of time below, px. */
export const LEFT = 46;
const BOTTOM = 3;
const TOP = 3;
const STRIP_PX = 5;
/** Steps longer than this hold whole motions: streams drawn over each other would be one brown stripe, s. */
const LANES_FROM_S = 0.4;
/** Values so close in time are joined, s. */
const JOINED_S = 0.15;

/**
 * What the chart spans from bottom to top, in its own unit.
 * @param {Picture} picture
 * @returns {[number, number]}
 */
export function range(picture) {
  const { plot, line, limits, dots, from_s, to_s } = picture;
  const turns = wholeTurns(picture);
  if (plot.angle && turns === null) return [0, 360];
  let [least, most] = [Infinity, -Infinity];
  const take = (/** @type {number} */ a, /** @type {number} */ b) => {
    least = Math.min(least, a);
    most = Math.max(most, b);
  };
  for (const { chart, series } of plot.lines) {
    const found = line(chart, series);
    const both = found && extremes(found, from_s, to_s);
    if (both) take(both[0] * plot.factor, both[1] * plot.factor);
  }
  for (const dot of dots)
    if (dot.t_s >= from_s && dot.t_s <= to_s) take(dot.value * plot.factor, dot.value * plot.factor);
  const largest = Math.max(...limits.map((limit) => limit.value * plot.factor));
  if (limits.length > 0 && least <= most) {
    if (plot.cap) most = Math.min(Math.max(most, largest), largest * 1.25);
    else limits.forEach((limit) => take(limit.value * plot.factor, limit.value * plot.factor));
  }
  if (!(least <= most)) return [0, 1];
  if (plot.zero) least = Math.min(0, least);
  const room = Math.max((most - least) * 0.06, 10 ** -plot.digits);
  const turned = 360 * (turns ?? 0);
  return [plot.zero && least === 0 ? 0 : least - room - turned, most + room - turned];
}

/**
 * Headings go on beyond a full turn. In a view in which they change by less than half of one they are drawn close
 * to, so many whole turns less; null: by the whole circle.
 * @param {Picture} picture
 * @returns {number | null}
 */
function wholeTurns({ plot, line, from_s, to_s }) {
  if (!plot.angle) return null;
  const all = plot.lines.flatMap((l) => {
    const found = line(l.chart, l.series);
    return (found && extremes(found, from_s, to_s)) ?? [];
  });
  const [least, most] = [Math.min(...all) * plot.factor, Math.max(...all) * plot.factor];
  return most - least < 180 ? Math.floor((least + most) / 720) : null;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Picture} picture
 */
export function drawPlot(canvas, picture) {
  const g = canvas.getContext("2d");
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!g || width === 0) return;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  const { plot, from_s, to_s, limits } = picture;
  const ink = inkOf();
  const [least, most] = range(picture);
  const bottom = height - BOTTOM - (plot.strips?.length ?? 0) * STRIP_PX;
  const x = (/** @type {number} */ s) => LEFT + ((s - from_s) / (to_s - from_s)) * (width - LEFT);
  const y = (/** @type {number} */ v) => bottom - ((v - least) / (most - least)) * (bottom - TOP);

  g.font = `11px ${ink.font}`;
  g.textAlign = "right";
  g.textBaseline = "middle";
  g.lineWidth = 1;
  const turns = wholeTurns(picture);
  const lanes = lanesOf(picture);
  /** Where a value is in a lane, the first on top. @param {number} lane @returns {(v: number) => number} */
  const inLane = (lane) => (v) => TOP + (lane * (bottom - TOP) + y(v) - TOP) / lanes.length;
  for (const tick of plot.angle && turns === null ? [0, 90, 180, 270, 360] : ticks(least, most)) {
    if (lanes.length > 1) break;
    g.strokeStyle = ink.plan;
    g.beginPath();
    g.moveTo(LEFT, Math.round(y(tick)) + 0.5);
    g.lineTo(width, Math.round(y(tick)) + 0.5);
    g.stroke();
    g.fillStyle = ink.muted;
    const words = String(Number(tick.toPrecision(6))).replace("-", "−");
    g.fillText(words, LEFT - 5, Math.min(height - 6, Math.max(6, y(tick))));
  }
  // A lane is too low for more than the largest of its ticks.
  const top = Math.max(...ticks(least, most));
  for (let lane = 0; lane < lanes.length && lanes.length > 1; lane++) {
    g.strokeStyle = ink.plan;
    g.beginPath();
    for (const at of [inLane(lane)(top), inLane(lane)(least)]) {
      g.moveTo(LEFT, Math.round(at) + 0.5);
      g.lineTo(width, Math.round(at) + 0.5);
    }
    g.stroke();
    g.fillStyle = ink.muted;
    g.fillText(String(Number(top.toPrecision(6))), LEFT - 5, inLane(lane)(top));
  }
  g.save();
  g.beginPath();
  g.rect(LEFT, 0, width - LEFT, height);
  g.clip();
  (plot.strips ?? []).forEach((strip, i, { length }) =>
    drawStrip(g, picture.line(strip.chart, strip.series), x, height - STRIP_PX * (length - i), inkNamed(strip.ink)),
  );
  for (const limit of limits) {
    g.strokeStyle = limit.name === "gate" ? ink.bad : ink.warn;
    g.setLineDash([5, 4]);
    g.beginPath();
    for (let lane = 0; lane < lanes.length; lane++) {
      g.moveTo(LEFT, inLane(lane)(limit.value * plot.factor));
      g.lineTo(width, inLane(lane)(limit.value * plot.factor));
    }
    g.stroke();
    g.setLineDash([]);
  }
  for (const line of plot.lines) {
    const found = picture.line(line.chart, line.series);
    if (!found) continue;
    g.strokeStyle = g.fillStyle = inkNamed(line.ink);
    const sigma = line.sigma && picture.line(line.sigma, line.series);
    if (sigma) drawBand(g, found, sigma, plot.factor, x, y);
    if (line.dots) drawDots(g, found, plot, most, x, y);
    else {
      g.lineWidth = 1.3;
      g.globalAlpha = line.translucent && lanes.length === 1 ? 0.7 : 1;
      g.setLineDash(line.dash ?? []);
      drawLine(g, found, plot, turns, x, inLane(Math.max(0, lanes.indexOf(line.series))), from_s, to_s);
      g.setLineDash([]);
      g.globalAlpha = 1;
    }
  }
  for (const dot of picture.dots) {
    if (dot.t_s < from_s || dot.t_s > to_s) continue;
    g.fillStyle = dot.bad ? ink.bad : ink.arrow;
    g.beginPath();
    g.arc(x(dot.t_s), y(Math.min(most, dot.value * plot.factor)), 3.5, 0, 2 * Math.PI);
    g.fill();
  }
  g.restore();
}

/**
 * The streams that are drawn below each other, by their series; one for all where they are drawn over each other.
 * @param {Picture} picture
 * @returns {string[]}
 */
export function lanesOf({ plot, line }) {
  if (!plot.lines.some((one) => one.translucent) || plot.lines.some((one) => one.dots)) return [""];
  const coarse = plot.lines.some((one) => {
    const found = line(one.chart, one.series);
    return found?.high !== undefined && found.high !== null && found.step_s > LANES_FROM_S;
  });
  return coarse ? [...new Set(plot.lines.map((one) => one.series))] : [""];
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {Line} line
 * @param {import("./plots.js").Plot} plot
 * @param {number | null} turns
 * @param {(s: number) => number} x
 * @param {(v: number) => number} y
 * @param {number} from_s
 * @param {number} to_s
 */
function drawLine(g, line, plot, turns, x, y, from_s, to_s) {
  const high = line.high ?? line.low;
  const first = Math.max(0, Math.floor((from_s - line.start_s) / line.step_s) - 1);
  const end = Math.min(line.low.length, Math.ceil((to_s - line.start_s) / line.step_s) + 1);
  g.beginPath();
  let drawing = false;
  let last = 0;
  let lastAt = 0;
  for (let i = first; i < end; i++) {
    let [a, b] = [line.low[i], high[i]];
    if (a === null || b === null) continue;
    // Steps may be shorter than the time between two samples: such a hole is none.
    if (drawing && (i - lastAt) * line.step_s > Math.max(JOINED_S, 1.5 * line.step_s)) drawing = false;
    lastAt = i;
    a *= plot.factor;
    b *= plot.factor;
    if (turns !== null) {
      a -= 360 * turns;
      b -= 360 * turns;
    } else if (plot.angle) {
      const [middle, half] = [wrapDegrees((a + b) / 2), Math.min(180, (b - a) / 2)];
      [a, b] = [middle - half, middle + half];
      if (drawing && Math.abs(middle - last) > 180) drawing = false;
      last = middle;
    }
    const px = x(line.start_s + (i + 0.5) * line.step_s);
    if (drawing) g.lineTo(px, y(a));
    else g.moveTo(px, y(a));
    // A single value between two holes is a dot, not nothing.
    if (b > a) g.lineTo(px, y(b));
    else if (!drawing) g.lineTo(px + 1, y(a));
    drawing = true;
  }
  g.stroke();
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {Line} line
 * @param {import("./plots.js").Plot} plot
 * @param {number} most values beyond are drawn at the edge
 * @param {(s: number) => number} x
 * @param {(v: number) => number} y
 */
function drawDots(g, line, plot, most, x, y) {
  const high = line.high ?? line.low;
  line.low.forEach((low, i) => {
    const top = high[i];
    if (low === null || top === null) return;
    const px = x(line.start_s + (i + 0.5) * line.step_s);
    const [a, b] = [y(Math.min(most, low * plot.factor)), y(Math.min(most, top * plot.factor))];
    g.fillRect(px - 1, b - 1, 2, a - b + 2);
  });
}

/**
 * A value give or take its sigma.
 * @param {CanvasRenderingContext2D} g
 * @param {Line} line
 * @param {Line} sigma of the same steps
 * @param {number} factor
 * @param {(s: number) => number} x
 * @param {(v: number) => number} y
 */
function drawBand(g, line, sigma, factor, x, y) {
  const width_px = Math.max(1, x(line.step_s) - x(0) + 0.5);
  g.globalAlpha = 0.14;
  line.low.forEach((low, i) => {
    const [top, by] = [(line.high ?? line.low)[i], (sigma.high ?? sigma.low)[i]];
    if (low === null || top === null || by === null || by === undefined) return;
    const [a, b] = [y((low - by) * factor), y((top + by) * factor)];
    g.fillRect(x(line.start_s + i * line.step_s), b, width_px, a - b);
  });
  g.globalAlpha = 1;
}

/**
 * A strip: full where the line is 1, thin where it is both 1 and 0 within the step.
 * @param {CanvasRenderingContext2D} g
 * @param {Line | undefined} line
 * @param {(s: number) => number} x
 * @param {number} top
 * @param {string} ink
 */
function drawStrip(g, line, x, top, ink) {
  if (!line) return;
  const width_px = Math.max(1, x(line.step_s) - x(0) + 0.5);
  g.fillStyle = ink;
  line.low.forEach((low, i) => {
    const high = (line.high ?? line.low)[i];
    if (!high) return;
    g.globalAlpha = low ? 0.75 : 0.3;
    g.fillRect(x(line.start_s + i * line.step_s), top, width_px, STRIP_PX - 1);
  });
  g.globalAlpha = 1;
}
