// The markers' own screen on the map: the chosen one, suspect surveys with the way they are off, and what a file
// would change. Shapes carry the meaning: a plus is added, a cross removed, an arrow goes from where it stands.

/**
 * @typedef {{e_m: number, n_m: number, u_m: number | null}} SurveyPlace
 * @typedef {{name: string, change: "added" | "changed" | "removed", before: SurveyPlace | null, after: SurveyPlace | null, line: number | null, moved_m: number | null, raised_m: number | null, sigma_m?: [number, number, number] | null}} Difference
 * @typedef {{
 *   selected: {name: string, e_m: number, n_m: number} | null,
 *   suspects: {e_m: number, n_m: number, mean_m: number[]}[],
 *   differences: Difference[],
 * }} Survey
 */

/**
 * @param {() => Survey | null} content
 * @returns {import("./canvas.js").Draw}
 */
export function drawSurvey(content) {
  return (g, { x, y, scale, ink, sees }) => {
    const survey = content();
    if (!survey) return;
    g.lineCap = g.lineJoin = "round";

    g.lineWidth = 2;
    for (const { e_m, n_m, mean_m } of survey.suspects) {
      if (!sees(e_m, n_m, 60)) continue;
      g.strokeStyle = g.fillStyle = ink.warn;
      square(g, x(e_m), y(n_m), 7);
      arrow(g, x(e_m), y(n_m), x(e_m + mean_m[0]), y(n_m + mean_m[1]));
    }

    for (const { change, before, after } of survey.differences) {
      const at = after ?? before;
      if (!at || !sees(at.e_m, at.n_m, 60)) continue;
      const [px, py] = [x(at.e_m), y(at.n_m)];
      const r = Math.max(3.5, Math.min(6, scale));
      g.lineWidth = 2;
      if (change === "added") {
        g.strokeStyle = ink.arrow;
        stroke(g, [px - r, py, px + r, py], [px, py - r, px, py + r]);
      } else if (change === "removed") {
        g.strokeStyle = ink.bad;
        stroke(g, [px - r, py - r, px + r, py + r], [px - r, py + r, px + r, py - r]);
      } else if (before && after) {
        g.strokeStyle = g.fillStyle = ink.accent;
        ring(g, px, py, r);
        arrow(g, x(before.e_m), y(before.n_m), px, py);
      }
    }

    const { selected } = survey;
    if (selected) {
      const [px, py] = [x(selected.e_m), y(selected.n_m)];
      g.lineWidth = 2.5;
      g.strokeStyle = ink.accent;
      ring(g, px, py, 9);
      g.font = `600 12px ${ink.font}`;
      g.textAlign = "center";
      g.textBaseline = "bottom";
      g.lineWidth = 3;
      g.strokeStyle = ink.halo;
      g.strokeText(selected.name, px, py - 12);
      g.fillStyle = ink.text;
      g.fillText(selected.name, px, py - 12);
    }
  };
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number[][]} lines each from x, y to x, y
 */
function stroke(g, ...lines) {
  g.beginPath();
  for (const [ax, ay, bx, by] of lines) {
    g.moveTo(ax, ay);
    g.lineTo(bx, by);
  }
  g.stroke();
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} r
 */
function ring(g, x, y, r) {
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.stroke();
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} r
 */
function square(g, x, y, r) {
  g.strokeRect(x - r, y - r, 2 * r, 2 * r);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} ax
 * @param {number} ay
 * @param {number} bx
 * @param {number} by
 */
function arrow(g, ax, ay, bx, by) {
  const length = Math.hypot(bx - ax, by - ay);
  // Shorter than its own head it says nothing.
  if (length < 6) return;
  stroke(g, [ax, ay, bx, by]);
  const angle = Math.atan2(by - ay, bx - ax);
  const head = Math.min(8, length * 0.6);
  g.beginPath();
  g.moveTo(bx, by);
  g.lineTo(bx - head * Math.cos(angle - 0.45), by - head * Math.sin(angle - 0.45));
  g.lineTo(bx - head * Math.cos(angle + 0.45), by - head * Math.sin(angle + 0.45));
  g.fill();
}
