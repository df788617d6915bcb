// What a walk has found out besides positions: visits at markers, stands with the markers that they may have
// been at, and trouble with the sensors.

/**
 * @typedef {{
 *   id?: string, session_id: string, marker: string, t_start_ns: number, t_end_ns: number, t_applied_ns?: number,
 *   origin?: "keyed" | "chosen" | "automatic", accepted?: boolean, nis?: number, degrees_of_freedom?: number,
 *   before_minus_marker_m?: number[], after_minus_marker_m?: number[], reason?: string,
 * }} Visit the outcome is there once the visit has been weighed
 * @typedef {{
 *   session_id: string, anomaly: string, t_start_ns: number, t_end_ns: number, samples: number, detail: string,
 *   figures?: import("../sentences.js").Figures | null, times?: number,
 * }} Anomaly its system knows which stream it is of; one may tell of several times
 * @typedef {{marker: string | null, probability: number, distance_m: number | null}} Candidate
 * @typedef {{
 *   number: number, t_start_ns: number, t_end_ns: number, lasts: boolean, position_m: number[], candidates: Candidate[],
 * }} Stand likeliest candidate first; the one without a marker stands for none of those named
 */

/** Candidates of a stand that are shown by name. */
const SHOWN = 4;

/**
 * The visit that belongs to a stand: the one whose times overlap it.
 * @param {Stand} stand
 * @param {Visit[]} visits
 */
export function visitOfStand(stand, visits) {
  return visits.find((visit) => visit.t_start_ns <= stand.t_end_ns && visit.t_end_ns >= stand.t_start_ns) ?? null;
}

/**
 * The likeliest by name, and the share of all the rest: together they are one.
 * @param {Stand} stand
 */
export function standChoices(stand) {
  const named = stand.candidates.filter((candidate) => candidate.marker !== null).slice(0, SHOWN);
  const none = Math.max(0, 1 - named.reduce((sum, candidate) => sum + candidate.probability, 0));
  return { named, none };
}

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
