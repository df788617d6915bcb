// Which computations of a walk are laid over each other: those that the server keeps, and those by chosen aids
// that it computes when it is asked.

/** @typedef {"main" | "filtered" | "without_markers"} StoredRun */

/** The aids that a run may be computed with, in the order in which they are built up. */
export const AIDS = ["zupt", "heading", "maru", "separation", "altimeter", "markers"];

/** Runs that show what each aid brings. */
export const LADDER = [["zupt"], ["zupt", "heading"], ["zupt", "heading", "maru"], ["zupt", "heading", "maru", "separation"]];

/** @type {StoredRun[]} */
export const STORED = ["main", "filtered", "without_markers"];

/**
 * A run by chosen aids has a name that says which: it stands in the address.
 * @param {string[]} aids
 */
export const runByAids = (aids) => `aids:${AIDS.filter((aid) => aids.includes(aid)).join("+")}`;

/**
 * @param {string} run
 * @returns {string[] | null} null for one that the server keeps or that nobody knows
 */
export function aidsOf(run) {
  if (!run.startsWith("aids:")) return null;
  const aids = run.slice(5).split("+").filter((aid) => AIDS.includes(aid));
  return aids.length > 0 ? aids : null;
}

/**
 * Length of a path in plan, m: by steps of a metre, so that the sway of a standing person adds nothing.
 * @param {{e_m: ArrayLike<number>, n_m: ArrayLike<number>}} track
 */
export function pathLength(track) {
  let length_m = 0;
  let [e, n] = [track.e_m[0], track.n_m[0]];
  for (let i = 1; i < track.e_m.length; i++) {
    const step_m = Math.hypot(track.e_m[i] - e, track.n_m[i] - n);
    if (step_m < 1) continue;
    length_m += step_m;
    [e, n] = [track.e_m[i], track.n_m[i]];
  }
  return length_m;
}
