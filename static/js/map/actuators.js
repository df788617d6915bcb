// The actuators: 2,226 dots on a canvas of their own. Names appear only where they do not run into each other.

/** The least distance of two actuators in plan, near the rim; most stand 10 m apart. */
const SPACING_M = 6;
/** Names are drawn when neighbours are at least this far apart on the screen. */
const LABEL_SPACING_PX = 24;

/** Those that stand out are few: they are named earlier. */
const SPECIAL_SPACING_PX = 14;

/**
 * @param {() => {name: string, e_m: number, n_m: number}[]} places
 * @param {() => {named: Set<string>, goal: string | null}} marked actuators to stand out: near the selected
 *   person, and the one that was gone to
 * @returns {import("./canvas.js").Draw}
 */
export function drawActuators(places, marked) {
  return (g, { x, y, scale, ink, sees }) => {
    const { named, goal } = marked();
    const nodes = places();
    const radius = Math.min(4, Math.max(1, 0.55 * scale));
    const labels = SPACING_M * scale >= LABEL_SPACING_PX;
    g.fillStyle = ink.dot;
    g.beginPath();
    for (const node of nodes) {
      if (!sees(node.e_m, node.n_m)) continue;
      const [px, py] = [x(node.e_m), y(node.n_m)];
      g.moveTo(px + radius, py);
      g.arc(px, py, radius, 0, 2 * Math.PI);
    }
    g.fill();

    g.textAlign = "center";
    g.textBaseline = "top";
    g.lineWidth = 3;
    g.lineJoin = "round";
    const size = SPACING_M * scale >= 34 ? 11 : 10;
    for (const node of nodes) {
      const special = named.has(node.name) || node.name === goal;
      if (!(labels || special) || !sees(node.e_m, node.n_m)) continue;
      const isNamed = labels || node.name === goal || SPACING_M * scale >= SPECIAL_SPACING_PX;
      const [px, py] = [x(node.e_m), y(node.n_m)];
      if (special) {
        g.strokeStyle = node.name === goal ? ink.accent : ink.muted;
        g.lineWidth = node.name === goal ? 2 : 1.2;
        g.beginPath();
        g.arc(px, py, radius + 3.5, 0, 2 * Math.PI);
        g.stroke();
        if (node.name === goal) cross(g, px, py, radius + 3.5);
      }
      if (!isNamed) continue;
      g.font = `${special ? "600 11px" : `${size}px`} ${ink.font}`;
      g.lineWidth = 3;
      g.strokeStyle = ink.halo;
      g.strokeText(node.name, px, py + radius + (special ? 5 : 2));
      g.fillStyle = special ? ink.text : ink.dotLabel;
      g.fillText(node.name, px, py + radius + (special ? 5 : 2));
    }
  };
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} r
 */
function cross(g, x, y, r) {
  g.beginPath();
  for (const [dx, dy] of [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
  ]) {
    g.moveTo(x + dx * r, y + dy * r);
    g.lineTo(x + dx * (r + 8), y + dy * (r + 8));
  }
  g.stroke();
}
