// Faults on the map. The shape tells the severity, colour only repeats it: circle low, triangle medium, diamond high.

/** @typedef {import("../state/live.js").Fault} Fault */

/** Half the height of the sign, px. */
const SIZE = { low: 6, medium: 7.5, high: 8.5 };

/**
 * @param {() => {faults: Fault[], selected: string | null}} content
 * @returns {import("./canvas.js").Draw}
 */
export function drawFaults(content) {
  return (g, { x, y, ink, sees }) => {
    const { faults, selected } = content();
    for (const fault of faults) {
      if (!fault.position_m || !sees(fault.position_m[0], fault.position_m[1])) continue;
      const [px, py] = [x(fault.position_m[0]), y(fault.position_m[1])];
      const r = SIZE[fault.severity] ?? SIZE.low;
      g.globalAlpha = fault.state === "verified" ? 0.4 : 1;
      g.beginPath();
      sign(g, fault.severity, px, py, r);
      g.fillStyle = ink[fault.severity] ?? ink.low;
      g.lineWidth = 4;
      g.strokeStyle = ink.halo;
      g.lineJoin = "round";
      g.stroke();
      g.fill();
      if (fault.id === selected) {
        g.beginPath();
        g.arc(px, py, r + 6, 0, 2 * Math.PI);
        g.lineWidth = 2;
        g.strokeStyle = ink.accent;
        g.stroke();
      }
      g.globalAlpha = 1;
    }
  };
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {string} severity
 * @param {number} x
 * @param {number} y
 * @param {number} r
 */
function sign(g, severity, x, y, r) {
  if (severity === "high")
    polygon(g, [
      [x, y - r],
      [x + r, y],
      [x, y + r],
      [x - r, y],
    ]);
  else if (severity === "medium")
    polygon(g, [
      [x, y - r],
      [x + r, y + r * 0.8],
      [x - r, y + r * 0.8],
    ]);
  else g.arc(x, y, r, 0, 2 * Math.PI);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {[number, number][]} corners
 */
function polygon(g, corners) {
  corners.forEach(([x, y], i) => (i === 0 ? g.moveTo(x, y) : g.lineTo(x, y)));
  g.closePath();
}

/**
 * The fault whose sign is at a place, if any.
 * @param {Fault[]} faults
 * @param {import("../geometry.js").EastNorth} place
 * @param {number} reach_m
 */
export function faultAt(faults, place, reach_m) {
  let best = null;
  let nearest = reach_m;
  for (const fault of faults) {
    if (!fault.position_m) continue;
    const d = Math.hypot(fault.position_m[0] - place[0], fault.position_m[1] - place[1]);
    if (d < nearest) [best, nearest] = [fault, d];
  }
  return best;
}
