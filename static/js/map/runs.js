// Finished walks on the map: their runs laid over each other, a cursor on each walk, and each visit's correction
// as an arrow from where the filter thought it was to where the marker put it.

import { inkNamed } from "./ink.js";

/**
 * @typedef {import("../geometry.js").EastNorth} EastNorth
 * @typedef {{from: EastNorth, to: EastNorth, marker: string, length_m: number, accepted: boolean}} Correction
 * @typedef {{points: EastNorth[], ink: string, dash: number[], width: number}} RunLine `ink` is a name of `inkNamed`
 * @typedef {{place: EastNorth, ink: string, label: string, radius_px?: number}} RunCursor
 * @typedef {{
 *   lines: RunLine[], cursors: RunCursor[], corrections: Correction[], arrows: boolean, selected: string | null,
 * }} Runs the line drawn last is the one whose ends are marked
 */

/**
 * @param {() => Runs | null} content
 * @returns {import("./canvas.js").Draw}
 */
export function drawRuns(content) {
  return (g, paper) => {
    const runs = content();
    if (!runs) return;
    const { x, y, ink } = paper;
    g.lineCap = g.lineJoin = "round";
    // Told apart by dashes as well as by colour.
    for (const line of runs.lines) track(g, paper, line.points, inkNamed(line.ink), line.width, line.dash);
    const last = runs.lines.at(-1);
    if (last && last.points.length > 0) {
      const [[startX, startY], [endX, endY]] = [last.points[0], last.points[last.points.length - 1]];
      dot(g, x(startX), y(startY), 5, ink.halo, inkNamed(last.ink));
      dot(g, x(endX), y(endY), 5, inkNamed(last.ink), ink.halo);
    }
    if (runs.arrows)
      for (const correction of runs.corrections) arrow(g, paper, correction, correction.marker === runs.selected);
    for (const cursor of runs.cursors) {
      const [cx, cy] = [x(cursor.place[0]), y(cursor.place[1])];
      dot(g, cx, cy, cursor.radius_px ?? 7, inkNamed(cursor.ink), ink.halo);
      if (cursor.label) words(g, paper, cursor.label, cx + 11, cy);
    }
  };
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas.js").Paper} paper
 * @param {EastNorth[]} points
 * @param {string} colour
 * @param {number} width
 * @param {number[]} dash
 */
function track(g, { x, y }, points, colour, width, dash) {
  g.beginPath();
  let [lastX, lastY] = [NaN, NaN];
  points.forEach(([e, n], i) => {
    const [px, py] = [x(e), y(n)];
    if (i === 0) g.moveTo(px, py);
    else if (Math.abs(px - lastX) >= 1 || Math.abs(py - lastY) >= 1) g.lineTo(px, py);
    else return;
    [lastX, lastY] = [px, py];
  });
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.setLineDash(dash);
  g.stroke();
  g.setLineDash([]);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} r
 * @param {string} fill
 * @param {string} rim
 */
function dot(g, x, y, r, fill, rim) {
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.fillStyle = fill;
  g.fill();
  g.lineWidth = 2;
  g.strokeStyle = rim;
  g.stroke();
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas.js").Paper} paper
 * @param {Correction} correction
 * @param {boolean} selected
 */
function arrow(g, { x, y, scale, ink }, correction, selected) {
  const [ax, ay] = [x(correction.from[0]), y(correction.from[1])];
  const [bx, by] = [x(correction.to[0]), y(correction.to[1])];
  const colour = correction.accepted ? ink.arrow : ink.bad;
  g.strokeStyle = g.fillStyle = colour;
  g.lineWidth = selected ? 3 : 1.8;
  g.setLineDash(correction.accepted ? [] : [3, 3]);
  g.beginPath();
  g.moveTo(ax, ay);
  g.lineTo(bx, by);
  g.stroke();
  g.setLineDash([]);
  const px = Math.hypot(bx - ax, by - ay);
  if (px > 5) {
    const angle = Math.atan2(by - ay, bx - ax);
    const head = Math.min(8, px * 0.6);
    g.beginPath();
    g.moveTo(bx, by);
    g.lineTo(bx - head * Math.cos(angle - 0.45), by - head * Math.sin(angle - 0.45));
    g.lineTo(bx - head * Math.cos(angle + 0.45), by - head * Math.sin(angle + 0.45));
    g.fill();
  }
  dot(g, bx, by, selected ? 5 : 3.2, colour, ink.halo);
  if (scale >= 1.2 || selected)
    words(g, { ink }, `${correction.marker} · ${correction.length_m.toFixed(1)} m`, bx + 8, by);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {{ink: import("./ink.js").Ink}} paper
 * @param {string} text
 * @param {number} left
 * @param {number} middle
 */
function words(g, { ink }, text, left, middle) {
  g.font = `600 11px ${ink.font}`;
  g.textAlign = "left";
  g.textBaseline = "middle";
  g.lineWidth = 3;
  g.strokeStyle = ink.halo;
  g.strokeText(text, left, middle);
  g.fillStyle = ink.text;
  g.fillText(text, left, middle);
}
