// Plane geometry in the site's east-north metres. No browser, no map library: everything here is tested by itself.

/** @typedef {[number, number]} EastNorth metres from the site's origin */

/**
 * Radius of the circle that holds 95 % of a two-dimensional normal distribution with unit sigma:
 * the square root of the 95 % point of χ² with two degrees of freedom, 5.991.
 */
export const K95 = Math.sqrt(-2 * Math.log(0.05));

/**
 * The ellipse of a horizontal covariance, by its eigenvalues.
 * @param {number} varianceE m²
 * @param {number} varianceN m²
 * @param {number} covarianceEN m²
 * @param {number} scale how many sigmas the ellipse stands for
 * @returns {{major_m: number, minor_m: number, angle_rad: number}} half axes; the angle of the long
 *   one, anticlockwise from east
 */
export function ellipse(varianceE, varianceN, covarianceEN, scale = K95) {
  const mean = (varianceE + varianceN) / 2;
  const spread = Math.hypot((varianceE - varianceN) / 2, covarianceEN);
  return {
    major_m: scale * Math.sqrt(Math.max(0, mean + spread)),
    // A covariance that came through rounding may be a hair below zero: a flat ellipse, not NaN.
    minor_m: scale * Math.sqrt(Math.max(0, mean - spread)),
    angle_rad: 0.5 * Math.atan2(2 * covarianceEN, varianceE - varianceN),
  };
}

/**
 * One sigma along the worst horizontal direction, m.
 * @param {number[]} sigma_m east, north, up
 * @param {number} covarianceEN m²
 */
export function worstSigma(sigma_m, covarianceEN) {
  return ellipse(sigma_m[0] ** 2, sigma_m[1] ** 2, covarianceEN, 1).major_m;
}

/** How far from a marker one stands while looking at it, one sigma on each axis, m. */
const ARM_M = 1;
/** Share of moments that are at no marker at all, before the position is known. */
const ELSEWHERE = 0.1;
/** Markers in a square metre: they form triangles of 10 m. */
const DENSITY_M2 = 0.0115;

/**
 * How likely each of some places is the true one, given a position and its covariance. The same rule as
 * the server's for faults: the person stood anywhere, or within an arm's length of one of the markers;
 * Bayes' rule gives the shares. They add up to less than one: the rest is "at none of them".
 * @template {{e_m: number, n_m: number}} Place
 * @param {EastNorth} at
 * @param {number[]} sigma_m east, north
 * @param {number} covarianceEN m²
 * @param {Place[]} places
 * @returns {{place: Place, distance_m: number, probability: number}[]} the likeliest first
 */
export function rankPlaces(at, sigma_m, covarianceEN, places) {
  const a = sigma_m[0] ** 2 + ARM_M ** 2;
  const c = sigma_m[1] ** 2 + ARM_M ** 2;
  const determinant = a * c - covarianceEN ** 2;
  const ranked = places.map((place) => {
    const de = place.e_m - at[0];
    const dn = place.n_m - at[1];
    const mahalanobis2 = (c * de * de - 2 * covarianceEN * de * dn + a * dn * dn) / determinant;
    const weight = ((1 - ELSEWHERE) * Math.exp(-mahalanobis2 / 2)) / (2 * Math.PI * Math.sqrt(determinant));
    return { place, distance_m: Math.hypot(de, dn), weight };
  });
  const all = ELSEWHERE * DENSITY_M2 + ranked.reduce((sum, r) => sum + r.weight, 0);
  ranked.sort((x, y) => y.weight - x.weight);
  return ranked.map(({ place, distance_m, weight }) => ({ place, distance_m, probability: weight / all }));
}

/**
 * Degrees clockwise from true north, 0 to 360, from a heading in radians.
 * @param {number} heading_rad
 */
export function headingDegrees(heading_rad) {
  const degrees = (heading_rad * 180) / Math.PI;
  return ((degrees % 360) + 360) % 360;
}

/**
 * The sector in which a place is: they follow each other clockwise, each from its own first edge on.
 * @param {{name: string, azimuth_deg: number}[]} sectors
 * @param {EastNorth} place
 * @returns {string | null}
 */
export function sectorAt(sectors, [e, n]) {
  const azimuth_deg = headingDegrees(Math.atan2(e, n));
  const from = (/** @type {number} */ edge_deg) => (azimuth_deg - edge_deg + 360) % 360;
  const nearest = sectors.toSorted((a, b) => from(a.azimuth_deg) - from(b.azimuth_deg))[0];
  return nearest?.name ?? null;
}

/**
 * Length of a line through points, m.
 * @param {EastNorth[]} points
 */
export function lineLength(points) {
  let sum = 0;
  for (let i = 1; i < points.length; i++) {
    sum += Math.hypot(points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]);
  }
  return sum;
}
