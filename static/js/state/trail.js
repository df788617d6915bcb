// The line that an inspector has walked. Points already shown may be corrected later: a revision is ordinary.

/**
 * @typedef {[number, number, number]} TrailPoint t_ns, east m, north m
 */

/** A shift of eight hours at two points a second. */
export const TRAIL_CAPACITY = 60_000;

/**
 * Index of the first point at or after a time.
 * @param {TrailPoint[]} trail
 * @param {number} t_ns
 */
export function firstAt(trail, t_ns) {
  let low = 0;
  let high = trail.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (trail[middle][0] < t_ns) low = middle + 1;
    else high = middle;
  }
  return low;
}

/**
 * Adds one point; a point with a time that is already there replaces it.
 * @param {TrailPoint[]} trail
 * @param {TrailPoint} point
 */
export function extend(trail, point) {
  const at = trail.length === 0 || trail[trail.length - 1][0] < point[0] ? trail.length : firstAt(trail, point[0]);
  const same = trail[at]?.[0] === point[0];
  trail.splice(at, same ? 1 : 0, point);
  if (trail.length > TRAIL_CAPACITY) trail.splice(0, trail.length - TRAIL_CAPACITY);
}

/**
 * Replaces the trail from the first to the last of these points' times.
 * @param {TrailPoint[]} trail
 * @param {TrailPoint[]} points oldest first
 */
export function revise(trail, points) {
  if (points.length === 0) return;
  const from = firstAt(trail, points[0][0]);
  const last = points[points.length - 1][0];
  let to = from;
  while (to < trail.length && trail[to][0] <= last) to++;
  trail.splice(from, to - from, ...points);
}
