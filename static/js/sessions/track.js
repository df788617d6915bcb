// A track as the server tells it (columns and rows), and what the session screen makes of it.

/**
 * @typedef {{run: string, columns: string[], rows: (number | boolean | null)[][]}} TrackTable
 * @typedef {{t_s: Float64Array, e_m: Float64Array, n_m: Float64Array, u_m: Float64Array, heading_rad: Float64Array, sigma_m: Float64Array, more: Record<string, Float64Array>}} Track
 *   `sigma_m` is the root of both horizontal variances together; `more` are the columns of its system; an empty field is not a number
 */

/**
 * @param {TrackTable} table
 * @param {import("../systems/index.js").System} system
 * @returns {Track}
 */
export function readTrack(table, system) {
  const column = (/** @type {string} */ name) => {
    const at = table.columns.indexOf(name);
    if (at < 0) throw new Error(`the track has no column ${name}; it has ${table.columns.join(", ")}`);
    return Float64Array.from(table.rows, (row) => (row[at] === null ? NaN : Number(row[at])));
  };
  const sigmaE = column("sigma_e_m");
  const sigmaN = column("sigma_n_m");
  return {
    t_s: column("t_s"),
    e_m: column("e_m"),
    n_m: column("n_m"),
    u_m: column("u_m"),
    heading_rad: column("heading_rad"),
    sigma_m: sigmaE.map((s, i) => Math.hypot(s, sigmaN[i])),
    more: Object.fromEntries(system.pointColumns.map((name) => [name, column(name)])),
  };
}

/**
 * @param {Track} track
 * @returns {import("../geometry.js").EastNorth[]}
 */
export function line(track) {
  return Array.from(track.e_m, (e, i) => [e, track.n_m[i]]);
}

/**
 * Index of the last point at or before a time; the first point when there is none.
 * @param {Track} track
 * @param {number} t_s
 */
export function indexAt(track, t_s) {
  let low = 0;
  let high = track.t_s.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (track.t_s[middle] <= t_s) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}

/**
 * Where the track is at a time: between its points along a straight line, at its ends beyond them.
 * @param {Track} track
 * @param {number} t_s
 * @returns {import("../geometry.js").EastNorth}
 */
export function placeAt(track, t_s) {
  const i = indexAt(track, t_s);
  const span_s = track.t_s[i + 1] - track.t_s[i];
  const share = span_s > 0 ? Math.min(1, Math.max(0, (t_s - track.t_s[i]) / span_s)) : 0;
  const between = (/** @type {Float64Array} */ values) =>
    share > 0 ? values[i] + share * (values[i + 1] - values[i]) : values[i];
  return [between(track.e_m), between(track.n_m)];
}

/**
 * The point of the track nearest to a place on the map.
 * @param {Track} track
 * @param {import("../geometry.js").EastNorth} place
 * @param {number} reach_m
 * @returns {number | null} its index
 */
export function nearestIndex(track, place, reach_m) {
  let best = null;
  let nearest = reach_m;
  for (let i = 0; i < track.e_m.length; i++) {
    const d = Math.hypot(track.e_m[i] - place[0], track.n_m[i] - place[1]);
    if (d < nearest) [best, nearest] = [i, d];
  }
  return best;
}

/**
 * Each visit's correction on the map: from where the filter had the inspector to where it put them.
 * @param {import("../state/findings.js").Visit[]} visits
 * @param {(name: string) => {e_m: number, n_m: number} | undefined} marker
 * @returns {import("../map/runs.js").Correction[]}
 */
export function corrections(visits, marker) {
  return visits.flatMap((visit) => {
    const place = marker(visit.marker);
    const before = visit.before_minus_marker_m;
    if (!place || !before) return [];
    const accepted = visit.accepted === true;
    // A visit that was turned down moved nothing: its line goes to the marker and says how far off it
    // was. Without the state after the update, the marker itself stands for that, too.
    const after = (accepted && visit.after_minus_marker_m) || [0, 0, 0];
    /** @type {import("../geometry.js").EastNorth} */
    const from = [place.e_m + before[0], place.n_m + before[1]];
    /** @type {import("../geometry.js").EastNorth} */
    const to = [place.e_m + after[0], place.n_m + after[1]];
    return [{ from, to, marker: visit.marker, length_m: Math.hypot(to[0] - from[0], to[1] - from[1]), accepted }];
  });
}
