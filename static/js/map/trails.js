// Where people have walked. The last minute is drawn strong, what came before it faint.

import { firstAt, lastPart } from "../state/trail.js";

/**
 * @typedef {{trail: import("../state/trail.js").TrailPoint[], colour: number, selected: boolean}} Walked
 */

/**
 * @param {() => {walked: Walked[], seconds: number}} content
 * @returns {import("./canvas.js").Draw}
 */
export function drawTrails(content) {
  return (g, paper) => {
    const { walked, seconds } = content();
    g.lineCap = g.lineJoin = "round";
    for (const { trail, colour, selected } of walked) {
      const part = lastPart(trail, seconds);
      if (part.length < 2) continue;
      const recent = firstAt(part, part[part.length - 1][0] - 60e9);
      g.strokeStyle = paper.ink.people[colour];
      g.lineWidth = selected ? 3 : 2;
      g.globalAlpha = selected ? 0.6 : 0.38;
      line(g, paper, part, 0, recent + 1);
      g.globalAlpha = selected ? 1 : 0.85;
      line(g, paper, part, recent, part.length);
      g.globalAlpha = 1;
    }
  };
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
    // Points closer than a pixel to the last one drawn would not be seen.
    if (Math.abs(px - lastX) < 1 && Math.abs(py - lastY) < 1 && i !== to - 1) continue;
    if (i === from) g.moveTo(px, py);
    else g.lineTo(px, py);
    [lastX, lastY] = [px, py];
  }
  g.stroke();
}
