// How sure we are of each position: the ellipse that holds it with 95 % probability, in true metres.

import { ellipse } from "../geometry.js";

/**
 * @param {() => {position: import("../state/live.js").Position, colour: number, selected: boolean, stale: boolean}[]} content
 * @returns {import("./canvas.js").Draw}
 */
export function drawEllipses(content) {
  return (g, { x, y, scale, ink }) => {
    for (const { position, colour, selected, stale } of content()) {
      const [e, n] = position.position_m;
      const { major_m, minor_m, angle_rad } = ellipse(
        position.sigma_m[0] ** 2,
        position.sigma_m[1] ** 2,
        position.covariance_en_m2,
      );
      g.beginPath();
      // The canvas' y points down: an angle anticlockwise on the ground is negative here.
      g.ellipse(x(e), y(n), major_m * scale, minor_m * scale, -angle_rad, 0, 2 * Math.PI);
      g.fillStyle = g.strokeStyle = ink.people[colour];
      g.globalAlpha = selected ? 0.2 : 0.11;
      g.fill();
      g.globalAlpha = selected ? 0.95 : 0.6;
      g.lineWidth = selected ? 1.6 : 1;
      g.setLineDash(stale ? [5, 4] : []);
      g.stroke();
      g.setLineDash([]);
      g.globalAlpha = 1;
    }
  };
}
