// A finished session on the map: its track smoothed, as the filter told it and without markers, and each visit's correction as an
// arrow from where the filter thought it was to where the marker put it.

/**
 * @typedef {import("../geometry.js").EastNorth} EastNorth
 * @typedef {{from: EastNorth, to: EastNorth, marker: string, length_m: number, accepted: boolean}} Correction
 * @typedef {{
 *   main: EastNorth[] | null, filtered: EastNorth[] | null, without: EastNorth[] | null, corrections: Correction[], cursor: EastNorth | null,
 *   arrows: boolean, selected: string | null,
 * }} Runs
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
    if (runs.without) track(g, paper, runs.without, ink.runB, 2, [7, 5]);
    if (runs.filtered) track(g, paper, runs.filtered, ink.runA, 1.4, [2, 4]);
    if (runs.main) track(g, paper, runs.main, ink.runA, 2.4, []);
    const ends = runs.main ?? runs.filtered ?? runs.without;
    if (ends && ends.length > 0) {
      dot(g, x(ends[0][0]), y(ends[0][1]), 5, ink.halo, ink.runA);
      dot(g, x(ends[ends.length - 1][0]), y(ends[ends.length - 1][1]), 5, ink.runA, ink.halo);
    }
    if (runs.arrows) for (const correction of runs.corrections) arrow(g, paper, correction, correction.marker === runs.selected);
    if (runs.cursor) {
      const [cx, cy] = [x(runs.cursor[0]), y(runs.cursor[1])];
      dot(g, cx, cy, 7, ink.accent, ink.halo);
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
  if (scale >= 1.2 || selected) {
    const words = `${correction.marker} · ${correction.length_m.toFixed(1)} m`;
    g.font = `600 11px ${ink.font}`;
    g.textAlign = "left";
    g.textBaseline = "middle";
    g.lineWidth = 3;
    g.strokeStyle = ink.halo;
    g.strokeText(words, bx + 8, by);
    g.fillStyle = ink.text;
    g.fillText(words, bx + 8, by);
  }
}
