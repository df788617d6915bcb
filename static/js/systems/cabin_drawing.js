// Where cabin and platform are, drawn: the plan with its circle, the height beside it, and the angles as dials.

import { inkNamed, inkOf } from "../map/ink.js";

/** The circle that the focus stays within, and sizes of cabin and platform, m. */
const CIRCLE_M = 103;
const CABIN_M = 6.5;
const PLATFORM_M = 2.0;
/** What the angles may be, rad: tilt of the cabin, of the platform; yaw goes all the way round. */
const LIMITS_RAD = [Math.PI, Math.PI / 12, Math.PI / 6];

/**
 * @typedef {{place_m: number[], angles_rad: number[], off_m: number[], level_m: number, alarm: boolean, near: boolean}} Shown
 * @typedef {{
 *   t_s: number, state: number | null, source: number | null, aids: boolean[], off_m: (number[] | null)[], sigma_m: (number | null)[],
 *   off_rad: (number[] | null)[], sigma_rad: (number | null)[],
 * }} Past one moment of the last minutes: of each body what is measured less what is planned, and its sigma
 * @typedef {{
 *   bodies: (Shown | null)[], trail: [number, number][], planned: [number, number][], past: Past[], now_s: number, names: string[],
 *   stations: {name: string, e_m: number, n_m: number}[],
 * }} Picture
 */

/**
 * A canvas as sharp as the screen.
 * @param {HTMLCanvasElement} canvas
 * @param {number} height CSS pixels
 * @returns {[CanvasRenderingContext2D, number]} and its width, CSS pixels
 */
export function paper(canvas, height) {
  canvas.style.width = "100%";
  canvas.style.height = `${height}px`;
  const width = canvas.getBoundingClientRect().width || 300;
  const scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const g = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = `11px ${inkOf().font}`;
  g.lineWidth = 1;
  return [g, width];
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {[number, number][]} points on the canvas
 */
export function stroke(g, points) {
  g.beginPath();
  points.forEach(([x, y], i) => (i === 0 ? g.moveTo(x, y) : g.lineTo(x, y)));
  g.stroke();
}

/**
 * The plan with the height strip at its side.
 * @param {HTMLCanvasElement} canvas
 * @param {Picture} picture
 */
export function drawPlan(canvas, { bodies, trail, planned, stations, names, past }) {
  const height = 240;
  const [g, width] = paper(canvas, height);
  const ink = inkOf();
  const half = Math.min(width - 60, height) / 2 - 6;
  const x0 = half + 6;
  const y0 = height / 2;
  const per_m = half / CIRCLE_M;
  const at = (/** @type {number[]} */ [e, n]) => /** @type {[number, number]} */ ([x0 + e * per_m, y0 - n * per_m]);
  g.strokeStyle = ink.planStrong;
  g.beginPath();
  g.arc(x0, y0, half, 0, 2 * Math.PI);
  g.stroke();
  g.fillStyle = ink.muted;
  g.fillText("206 m", 2, 11);
  g.fillText("N", x0 - 4, 12);
  const [cabin, platform] = bodies;
  const under = platform ?? cabin;
  const last = past.at(-1);
  if (under)
    for (const { name, e_m, n_m } of stations) {
      const k = names.indexOf(name);
      g.strokeStyle = last?.aids[k] ? ink.low : ink.bad;
      g.globalAlpha = 0.7;
      // Pillars stand far outside: of a ray the part within the circle shows.
      const long_m = Math.hypot(e_m, n_m);
      const share = Math.min(1, CIRCLE_M / Math.max(long_m, 1));
      stroke(g, [at([e_m * share, n_m * share]), at(under.place_m)]);
      g.globalAlpha = 1;
    }
  g.strokeStyle = ink.muted;
  g.setLineDash([4, 3]);
  stroke(g, planned.map(at));
  g.setLineDash([]);
  g.strokeStyle = ink.runA;
  g.lineWidth = 1.5;
  stroke(g, trail.map(at));
  bodies.forEach((body, k) => {
    if (!body) return;
    const [x, y] = at(body.place_m);
    const r = (k === 0 ? CABIN_M : PLATFORM_M) * per_m;
    g.strokeStyle = body.alarm ? ink.bad : inkNamed(String(k));
    g.lineWidth = 2;
    g.beginPath();
    g.arc(x, y, r, 0, 2 * Math.PI);
    if (k === 1) {
      g.fillStyle = g.strokeStyle;
      g.globalAlpha = 0.4;
      g.fill();
      g.globalAlpha = 1;
    }
    g.stroke();
    const [sin, cos] = [Math.sin(body.angles_rad[0]), Math.cos(body.angles_rad[0])];
    // The heading as a tick that begins at the ring.
    const from = r + (k === 0 ? 0 : 3);
    if (Number.isFinite(sin))
      stroke(g, [
        [x + from * sin, y - from * cos],
        [x + (from + 8) * sin, y - (from + 8) * cos],
      ]);
  });
  drawHeights(g, width - 46, height, bodies);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} height
 * @param {(Shown | null)[]} bodies
 */
function drawHeights(g, x, height, bodies) {
  const ink = inkOf();
  const [low_m, high_m] = [130, 175];
  const y = (/** @type {number} */ u_m) => height - 8 - ((u_m - low_m) / (high_m - low_m)) * (height - 16);
  g.strokeStyle = ink.planStrong;
  g.lineWidth = 1;
  stroke(g, [
    [x, y(low_m)],
    [x, y(high_m)],
  ]);
  g.fillStyle = ink.muted;
  for (const u_m of [140, 150, 160, 170]) {
    stroke(g, [
      [x, y(u_m)],
      [x + 4, y(u_m)],
    ]);
    g.fillText(String(u_m), x + 22, y(u_m) + 4);
  }
  bodies.forEach((body, k) => {
    if (!body) return;
    g.strokeStyle = inkNamed(String(k));
    g.lineWidth = 3;
    const at = y(Math.min(high_m, Math.max(low_m, body.place_m[2])));
    stroke(g, [
      [x - 6, at],
      [x + 18, at],
    ]);
  });
}

/**
 * Three dials: yaw, pitch and roll, a needle for each body; what the angles may be is drawn as an arc.
 * @param {HTMLCanvasElement} canvas
 * @param {(Shown | null)[]} bodies
 * @param {string[]} labels
 */
export function drawDials(canvas, bodies, labels) {
  const height = 96;
  const [g, width] = paper(canvas, height);
  const ink = inkOf();
  labels.forEach((label, axis) => {
    const [x, y, r] = [((axis + 0.5) * width) / 3, 44, 34];
    g.lineWidth = 1;
    g.strokeStyle = ink.planStrong;
    g.beginPath();
    g.arc(x, y, r, 0, 2 * Math.PI);
    g.stroke();
    if (axis > 0) {
      // Angles are drawn four times as large as they are.
      [LIMITS_RAD[1], LIMITS_RAD[2]].forEach((limit, k) => {
        g.strokeStyle = inkNamed(String(k));
        g.lineWidth = 3;
        const up = -Math.PI / 2;
        const arc = Math.min(Math.PI, limit * 4);
        g.beginPath();
        g.arc(x, y, r - 2 - 4 * k, up - arc, up + arc);
        g.stroke();
      });
    }
    bodies.forEach((body, k) => {
      const angle = body?.angles_rad[axis];
      if (angle === undefined || !Number.isFinite(angle)) return;
      const turned = axis === 0 ? angle : angle * 4;
      g.strokeStyle = inkNamed(String(k));
      g.lineWidth = k === 0 ? 3 : 1.5;
      stroke(g, [
        [x, y],
        [x + (r - 8) * Math.sin(turned), y - (r - 8) * Math.cos(turned)],
      ]);
    });
    const cabin = bodies[0]?.angles_rad[axis];
    const words = cabin === undefined || !Number.isFinite(cabin) ? "–" : `${((cabin * 180) / Math.PI).toFixed(3)}°`;
    g.fillStyle = ink.text;
    g.textAlign = "center";
    g.fillText(`${label} ${words}`, x, height - 4);
    g.textAlign = "left";
  });
}
