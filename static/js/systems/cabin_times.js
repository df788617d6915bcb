// What the cabin's board shows of the last minutes, drawn by time: what is measured against the plan, and what corrects the pose.

import { inkNamed, inkOf } from "../map/ink.js";
import { paper, stroke } from "./cabin_drawing.js";

/** @typedef {import("./cabin_drawing.js").Past} Past */

export const MINUTES = 10;
const AXIS_INKS = ["0", "1", "3"];
/** Bands of the error against the plan: what control keeps, what is measured of the cabin, of the platform, mm; of all angles, °. */
const BANDS_MM = [30, 15, 3];
const BANDS_DEG = [0.1];

/**
 * @param {number} t_s
 * @param {number} now_s
 * @param {number} left
 * @param {number} width
 */
const xOf = (t_s, now_s, left, width) => left + ((t_s - now_s + MINUTES * 60) / (MINUTES * 60)) * (width - left - 2);

/**
 * The position of one body, measured less planned, mm.
 * @param {HTMLCanvasElement} canvas
 * @param {{past: Past[], now_s: number}} picture
 * @param {number} which
 * @param {string} label
 */
export function drawOffPlan(canvas, { past, now_s }, which, label) {
  const [bands, most] = which === 0 ? [BANDS_MM, 40] : [BANDS_MM.slice(1), 20];
  const lines = past.map(({ t_s, off_m, sigma_m }) => ({
    t_s,
    off: off_m[which]?.map((m) => 1000 * m) ?? null,
    sigma: 1000 * (sigma_m[which] ?? 0),
  }));
  drawOff(canvas, lines, now_s, { bands, most, label, axes: ["e", "n", "u"] });
}

/**
 * The angles of one body, measured less planned, °.
 * @param {HTMLCanvasElement} canvas
 * @param {{past: Past[], now_s: number}} picture
 * @param {number} which
 * @param {string} label
 * @param {string[]} axes
 */
export function drawOffAngles(canvas, { past, now_s }, which, label, axes) {
  const degrees = 180 / Math.PI;
  const lines = past.map(({ t_s, off_rad, sigma_rad }) => ({
    t_s,
    off: off_rad[which]?.map((rad) => degrees * rad) ?? null,
    sigma: degrees * (sigma_rad[which] ?? 0),
  }));
  drawOff(canvas, lines, now_s, { bands: BANDS_DEG, most: 0.2, label, axes });
}

/**
 * Three lines over the last minutes, with bands and the sigma as a tube.
 * @param {HTMLCanvasElement} canvas
 * @param {{t_s: number, off: number[] | null, sigma: number}[]} moments
 * @param {number} now_s
 * @param {{bands: number[], most: number, label: string, axes: string[]}} words
 */
function drawOff(canvas, moments, now_s, { bands, most, label, axes }) {
  const height = 110;
  const [g, width] = paper(canvas, height);
  const ink = inkOf();
  const left = 34;
  const x = (/** @type {number} */ t_s) => xOf(t_s, now_s, left, width);
  const y = (/** @type {number} */ off) =>
    height / 2 - (Math.max(-most, Math.min(most, off)) / most) * (height / 2 - 6);
  const inks = [ink.high, ink.medium, ink.low].slice(3 - bands.length);
  bands.forEach((band, k) => {
    g.fillStyle = inks[k];
    g.globalAlpha = 0.12;
    g.fillRect(left, y(band), width - left, y(-band) - y(band));
    g.globalAlpha = 1;
    g.fillStyle = ink.muted;
    if (y(0) - y(band) > 7) g.fillText(`±${band}`, 0, y(band) + 4);
  });
  axes.forEach((_, axis) => {
    const known = moments.filter(({ off }) => Number.isFinite(off?.[axis]));
    if (known.length === 0) return;
    const at = (/** @type {{off: number[] | null}} */ { off }) => off?.[axis] ?? 0;
    g.fillStyle = g.strokeStyle = inkNamed(AXIS_INKS[axis]);
    g.globalAlpha = 0.18;
    g.beginPath();
    known.forEach((moment) => g.lineTo(x(moment.t_s), y(at(moment) + moment.sigma)));
    known.toReversed().forEach((moment) => g.lineTo(x(moment.t_s), y(at(moment) - moment.sigma)));
    g.fill();
    g.globalAlpha = 1;
    g.lineWidth = 1.3;
    stroke(
      g,
      known.map((moment) => [x(moment.t_s), y(at(moment))]),
    );
  });
  g.fillStyle = ink.text;
  g.fillText(label, left + 4, 12);
  let from = left + 10 + g.measureText(label).width;
  axes.forEach((axis, k) => {
    g.fillStyle = inkNamed(AXIS_INKS[k]);
    g.fillText(axis, from, 12);
    from += g.measureText(axis).width + 6;
  });
}

/** Height of a row by time, and where its time begins, CSS pixels. */
const ROW = 12;
const LEFT = 70;

/**
 * The name of the row and the time at a place of the drawing.
 * @param {HTMLCanvasElement} canvas
 * @param {{rows: string[], now_s: number}} picture
 * @param {number} x
 * @param {number} y
 * @returns {{name: string, t_s: number} | null}
 */
export function cellAt(canvas, { rows, now_s }, x, y) {
  const name = rows[Math.floor(y / ROW)];
  const width = canvas.getBoundingClientRect().width - LEFT;
  if (name === undefined || x < LEFT || width <= 0) return null;
  return { name, t_s: now_s + ((x - LEFT) / width - 1) * MINUTES * 60 };
}

/**
 * How far the filter was, what said where the platform is, and which aids corrected the pose, a row each.
 * @param {HTMLCanvasElement} canvas
 * @param {{past: Past[], now_s: number, names: string[]}} picture
 * @param {string[]} titles of the rows: of the state, of the platform, then of the aids
 */
export function drawAids(canvas, { past, now_s, names }, titles) {
  const [g, width] = paper(canvas, (names.length + 2) * ROW + 2);
  const ink = inkOf();
  const states = [ink.muted, ink.low, ink.warn, ink.bad, ink.bad];
  const sources = [ink.muted, ink.low, ink.warn, ink.bad];
  const x = (/** @type {number} */ t_s) => LEFT + ((t_s - now_s + MINUTES * 60) / (MINUTES * 60)) * (width - LEFT);
  titles.forEach((title, row) => {
    g.fillStyle = ink.text;
    g.fillText(title, 0, row * ROW + 10, LEFT - 4);
    past.forEach((moment, i) => {
      const until = past[i + 1]?.t_s ?? moment.t_s + 1;
      const isIn = moment.aids[row - 2];
      if (row === 0) g.fillStyle = states[moment.state ?? 0];
      else if (row === 1) g.fillStyle = sources[moment.source ?? 0];
      else g.fillStyle = isIn ? ink.low : ink.bad;
      g.globalAlpha = row < 2 || isIn ? 0.8 : 0.5;
      // A hole in what is known stays empty.
      const from = Math.max(LEFT, x(moment.t_s));
      g.fillRect(from, row * ROW + 1, Math.max(1, x(Math.min(until, moment.t_s + 30)) - from), ROW - 2);
    });
    g.globalAlpha = 1;
  });
}
