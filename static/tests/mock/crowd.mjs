// A site on its busiest day, for figures: many people who have walked for half an hour, and what they found.

import { fault, iso, nearest } from "./site.mjs";

const FAMILY = ["Chen", "李", "Okafor", "Zhang", "Novák", "王", "Silva", "赵", "Haddad", "Kim"];
const GIVEN = ["Wei", "娜", "Ada", "Min", "Petr"];
/** How long everybody has been out, s. */
const OUT_S = 1800;
/** The feed's first trails are simplified to 0.3 m: of somebody who sways as he walks, a point every second and a half. */
const POINT_EVERY_S = 1.5;
const KINDS = ["hydraulic_leak", "communication_loss", "panel_damage", "anchor_bolt", "cable_damage"];
const SEVERITIES = ["low", "medium", "high"];

/**
 * @param {import("./site.mjs").MockSite} site
 * @param {number} count
 */
export function makeCrowd(site, count) {
  return Array.from({ length: count }, (_, i) => {
    const inspector = {
      id: `i${i + 1}`,
      name: `${FAMILY[i % FAMILY.length]} ${GIVEN[Math.floor(i / FAMILY.length) % GIVEN.length]}`,
      created_at: iso(-86_400_000),
    };
    const walk = site.beginWalk(inspector, i % 4);
    walk.session.id = `s${i + 1}`;
    walk.session.started_at = iso(-OUT_S * 1000);
    // Spread along the road, which is 3.3 km long; nobody reaches its end while figures are taken.
    Object.assign(walk, {
      t_s: OUT_S + ((i * 7) % 40),
      s: 150 + (2700 * i) / count,
      sigma: 0.6 + (i % 9) * 0.45,
      since_m: (i * 37) % 260,
      since_s: (i * 31) % 240,
    });
    walk.trail = trail(site, walk, i);
    walk.visits = [];
    walk.stands = [];
    site.place(walk);
    return walk;
  });
}

/** Along the road to and fro to where somebody stands now, with the sway of a walk that is measured by the feet. */
function trail(site, walk, i) {
  const points = [];
  for (let back_s = OUT_S; back_s > 0; back_s -= POINT_EVERY_S) {
    const [e, n] = site.onRoad(Math.abs(walk.s - back_s * walk.speed));
    const sway = 0.5 * Math.sin(back_s * 0.9 + i) + 0.3 * Math.sin(back_s * 2.3);
    points.push([
      Math.round((walk.t_s - back_s) * 1e9),
      Number((e + sway).toFixed(3)),
      Number((n + sway * Math.cos(back_s)).toFixed(3)),
    ]);
  }
  return points;
}

/**
 * Every other one of them has found something.
 * @param {import("./site.mjs").MockSite} site
 * @param {number} count
 */
export function crowdFaults(site, count) {
  return Array.from({ length: Math.ceil(count / 2) }, (_, i) => {
    const walk = site.walks[(2 * i) % count];
    const [e, n] = site.onRoad(walk.s - 25);
    const marker = nearest(site.plan.nodes, e, n);
    return fault(
      `f${i + 1}`,
      walk.inspector.id,
      KINDS[i % KINDS.length],
      SEVERITIES[i % 3],
      [e, n, 20],
      [
        [marker.name, 0.7, 2.1],
        [null, 0.3, null],
      ],
    );
  });
}
