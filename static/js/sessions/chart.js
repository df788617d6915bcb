// Sigma over time, small: the saw teeth that markers cut. One line on a canvas needs no library.

import { inkOf } from "../map/ink.js";
import { elapsed } from "../format.js";

/** @typedef {{track: import("./track.js").Track, colour: "runA" | "runB", dash: number[]}} Curve */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Curve[]} curves
 * @param {number[]} ticks_s where a marker was visited
 * @param {number | null} cursor_s
 */
export function drawChart(canvas, curves, ticks_s, cursor_s) {
  const g = canvas.getContext("2d");
  if (!g || curves.length === 0) return;
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  const ink = inkOf();
  const end_s = Math.max(...curves.map((c) => c.track.t_s[c.track.t_s.length - 1] ?? 0), 1);
  const top_m = niceTop(Math.max(...curves.map((c) => c.track.sigma_m.reduce((a, b) => (b > a ? b : a), 0)), 0.5));
  const left = 34;
  const bottom = height - 16;
  const x = (/** @type {number} */ s) => left + (s / end_s) * (width - left - 2);
  const y = (/** @type {number} */ m) => bottom - (m / top_m) * (bottom - 4);

  g.font = `11px ${ink.font}`;
  g.fillStyle = ink.muted;
  g.strokeStyle = ink.plan;
  g.textBaseline = "middle";
  g.textAlign = "right";
  for (const m of [0, top_m / 2, top_m]) {
    g.beginPath();
    g.moveTo(left, y(m));
    g.lineTo(width, y(m));
    g.stroke();
    g.fillText(`${Number(m.toFixed(2))}`, left - 5, Math.max(6, y(m)));
  }
  g.textAlign = "left";
  g.fillText("0:00", left, height - 6);
  g.textAlign = "right";
  g.fillText(elapsed(end_s), width - 2, height - 6);
  g.fillStyle = ink.arrow;
  for (const s of ticks_s) g.fillRect(x(s) - 0.5, bottom - 4, 1.5, 5);

  for (const { track, colour, dash } of curves) {
    g.beginPath();
    // One point for each pixel: the largest sigma of those that fall on it.
    const per = Math.max(1, Math.floor(track.t_s.length / (width - left)));
    for (let i = 0; i < track.t_s.length; i += per) {
      let most = 0;
      for (let j = i; j < Math.min(i + per, track.t_s.length); j++) most = Math.max(most, track.sigma_m[j]);
      if (i === 0) g.moveTo(x(track.t_s[i]), y(most));
      else g.lineTo(x(track.t_s[i]), y(most));
    }
    g.setLineDash(dash);
    g.lineWidth = 1.5;
    g.strokeStyle = ink[colour];
    g.stroke();
    g.setLineDash([]);
  }
  if (cursor_s !== null) {
    g.fillStyle = ink.accent;
    g.fillRect(x(cursor_s) - 0.75, 0, 1.5, bottom);
  }
}

/** @param {number} value */
function niceTop(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 4, 5, 10].map((k) => k * decade).find((top) => top >= value) ?? 10 * decade;
}
