// A moment that is past, as the page has the present: so that the same list and the same map show it.

import { emptyState } from "./live.js";

/**
 * @typedef {import("./live.js").LiveState} LiveState
 * @typedef {{
 *   t_ns: number, age_s: number, position_m: [number, number, number], heading_rad: number, sigma_heading_rad: number,
 *   sigma_m: [number, number, number], covariance_en_m2: number,
 * }} PositionThen
 * @typedef {{session: any, position: PositionThen | null, trail: import("./trail.js").TrailPoint[]}} WalkThen
 * @typedef {{at: string, walks: WalkThen[]}} Moment
 */

/** The speed is taken from so much of the way there, s. */
const SPEED_OVER_S = 3;
/** Slower is standing, m/s: as far as a standing track drifts. */
const STANDING_M_S = 0.2;

/**
 * @param {Moment} moment
 * @param {LiveState} live who there is
 * @param {import("./live.js").Fault[]} faults all that were ever reported
 * @returns {LiveState}
 */
export function pastState(moment, live, faults) {
  const at_ms = Date.parse(moment.at);
  const state = emptyState();
  state.boot = live.boot;
  state.lost_after_s = live.lost_after_s;
  state.gone_after_s = live.gone_after_s;
  state.inspectors = live.inspectors;
  for (const { session, position, trail } of moment.walks) {
    state.sessions.set(session.id, {
      ...session,
      state: "live",
      position: position && { ...shown(session, position, trail, at_ms) },
      trail,
      // All of it is new to the map.
      revised_from_ns: -Infinity,
      visits: [],
      stands: [],
      anomalies: [],
    });
  }
  for (const fault of faults) {
    const closed = fault.closed_at ? Date.parse(fault.closed_at) : Infinity;
    // How far it had come by then is not told: it stood.
    if (Date.parse(fault.reported_at) <= at_ms && closed > at_ms)
      state.faults.set(fault.id, { ...fault, state: "open" });
  }
  return state;
}

/**
 * @param {any} session
 * @param {PositionThen} position
 * @param {import("./trail.js").TrailPoint[]} trail
 * @param {number} at_ms
 * @returns {import("./live.js").Position}
 */
function shown(session, position, trail, at_ms) {
  const speed_m_s = speedAtEnd(trail);
  return {
    session_id: session.id,
    inspector_id: session.inspector_id,
    t_ns: position.t_ns,
    position_m: position.position_m,
    heading_rad: position.heading_rad,
    sigma_heading_rad: position.sigma_heading_rad,
    sigma_m: position.sigma_m,
    covariance_en_m2: position.covariance_en_m2,
    speed_m_s,
    state: speed_m_s < STANDING_M_S ? "standing" : "walking",
    since_marker_s: null,
    since_marker_m: null,
    distance_m: NaN,
    received_at: new Date(at_ms - position.age_s * 1000).toISOString(),
  };
}

/** @param {import("./trail.js").TrailPoint[]} trail */
function speedAtEnd(trail) {
  const last = trail[trail.length - 1];
  const before = trail.findLast(([t_ns]) => t_ns <= last[0] - SPEED_OVER_S * 1e9);
  if (!before) return 0;
  return Math.hypot(last[1] - before[1], last[2] - before[2]) / ((last[0] - before[0]) / 1e9);
}

/**
 * Who was nearest to a place.
 * @param {LiveState} state
 * @param {import("../geometry.js").EastNorth} place
 * @param {number} most
 * @returns {{name: string, distance_m: number}[]}
 */
export function nearestTo(state, [e, n], most) {
  const found = [...state.sessions.values()].flatMap(({ inspector_id, position }) =>
    position
      ? [
          {
            name: state.inspectors.get(inspector_id)?.name ?? inspector_id.slice(0, 8),
            distance_m: Math.hypot(position.position_m[0] - e, position.position_m[1] - n),
          },
        ]
      : [],
  );
  return found.sort((a, b) => a.distance_m - b.distance_m).slice(0, most);
}

/**
 * How many walks were under way in each stretch of a day.
 * @param {{started_at: string | null, ended_at?: string | null, duration_s?: number}[]} sessions
 * @param {number} begins_ms
 * @param {number} stretches
 * @param {number} stretch_ms
 */
export function underWay(sessions, begins_ms, stretches, stretch_ms) {
  const counts = new Array(stretches).fill(0);
  for (const { started_at, ended_at, duration_s } of sessions) {
    if (!started_at) continue;
    const from_ms = Date.parse(started_at);
    const to_ms = ended_at ? Date.parse(ended_at) : from_ms + (duration_s ?? 0) * 1000;
    const first = Math.max(0, Math.floor((from_ms - begins_ms) / stretch_ms));
    const last = Math.min(stretches - 1, Math.floor((to_ms - begins_ms) / stretch_ms));
    for (let i = first; i <= last; i++) counts[i] += 1;
  }
  return counts;
}

/** A label of an hour, with room beside it. */
const LABEL_PX = 44;

/** Every how many hours a day's strip has room for a label. @param {number} width_px */
export const hoursBetweenLabels = (width_px) => [1, 2, 3, 6].find((hours) => (width_px * hours) / 24 >= LABEL_PX) ?? 12;
