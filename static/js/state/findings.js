// What a walk has found out besides positions: visits at markers, and trouble with the sensors.

/**
 * @typedef {{
 *   id?: string, session_id: string, marker: string, t_start_ns: number, t_end_ns: number, t_applied_ns?: number,
 *   accepted?: boolean, nis?: number, degrees_of_freedom?: number,
 *   before_minus_marker_m?: number[], after_minus_marker_m?: number[], reason?: string,
 * }} Visit the outcome is there once the visit has been weighed
 * @typedef {{
 *   session_id: string, anomaly: string, foot: string | null, t_start_ns: number, t_end_ns: number, samples: number, detail: string,
 * }} Anomaly
 */

/**
 * When it counted, seconds since the session's start.
 * @param {Visit} visit
 */
export function visitTime(visit) {
  return (visit.t_applied_ns ?? visit.t_start_ns) / 1e9;
}

/**
 * @param {Visit} visit
 * @returns {"accepted" | "rejected" | "waiting"}
 */
export function visitOutcome(visit) {
  if (visit.accepted === undefined || visit.accepted === null) return "waiting";
  return visit.accepted ? "accepted" : "rejected";
}

/**
 * How far the position was from the marker before the visit was used, in plan, m.
 * @param {Visit} visit
 */
export function offBefore(visit) {
  const off = visit.before_minus_marker_m;
  return off ? Math.hypot(off[0], off[1]) : null;
}
