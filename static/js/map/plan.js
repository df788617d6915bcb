// The site's plan: ring, sectors, spiral road, towers. Drawn once for each rest of the map.

/**
 * @typedef {{
 *   nodes: {name: string, sector: string, e_m: number, n_m: number, u_m: number}[],
 *   ring_radius_m: number, road: [number, number][],
 *   sectors: {name: string, azimuth_deg: number}[], towers: {name: string, e_m: number, n_m: number}[],
 * }} Plan
 */

/**
 * @param {Plan} plan
 * @returns {import("./canvas.js").Draw}
 */
export function drawPlan(plan) {
  const R = plan.ring_radius_m;
  // A sector's azimuth is that of its first edge; its letter stands in the middle of the way to the next.
  const step = plan.sectors.length > 0 ? 360 / plan.sectors.length : 0;
  return (g, { x, y, scale, ink }) => {
    g.lineCap = g.lineJoin = "round";

    g.beginPath();
    g.arc(x(0), y(0), R * scale, 0, 2 * Math.PI);
    g.fillStyle = ink.ground;
    g.fill();

    g.strokeStyle = ink.plan;
    g.lineWidth = 1;
    for (const sector of plan.sectors) {
      const [e, n] = polar(R, sector.azimuth_deg);
      g.beginPath();
      g.moveTo(x(0), y(0));
      g.lineTo(x(e), y(n));
      g.stroke();
    }

    g.strokeStyle = ink.planStrong;
    g.lineWidth = Math.max(2, 1.6 * scale);
    g.beginPath();
    g.arc(x(0), y(0), R * scale, 0, 2 * Math.PI);
    g.stroke();

    if (plan.road.length > 1) {
      g.beginPath();
      plan.road.forEach(([e, n], i) => (i === 0 ? g.moveTo(x(e), y(n)) : g.lineTo(x(e), y(n))));
      g.strokeStyle = ink.road;
      g.lineWidth = Math.max(2.5, 3 * scale);
      g.stroke();
    }

    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillStyle = ink.muted;
    g.font = `600 15px ${ink.font}`;
    for (const sector of plan.sectors) {
      const [e, n] = polar(R + 15 / scale, sector.azimuth_deg + step / 2);
      g.fillText(sector.name, x(e), y(n));
    }

    g.font = `11px ${ink.font}`;
    for (const tower of plan.towers) {
      const [tx, ty] = [x(tower.e_m), y(tower.n_m)];
      g.strokeStyle = ink.muted;
      g.lineWidth = 1.2;
      g.strokeRect(tx - 4, ty - 4, 8, 8);
      g.beginPath();
      g.moveTo(tx - 4, ty - 4);
      g.lineTo(tx + 4, ty + 4);
      g.moveTo(tx + 4, ty - 4);
      g.lineTo(tx - 4, ty + 4);
      g.stroke();
      g.fillText(tower.name, tx, ty + 13);
    }
  };
}

/**
 * @param {number} r_m
 * @param {number} azimuth_deg clockwise from true north
 * @returns {[number, number]} east, north
 */
export function polar(r_m, azimuth_deg) {
  const a = (azimuth_deg * Math.PI) / 180;
  return [r_m * Math.sin(a), r_m * Math.cos(a)];
}
