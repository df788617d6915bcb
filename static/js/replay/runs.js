// Which computations of a walk are laid over each other: those of its own, and those of the laboratory, by chosen aids or
// with other parameters.

/** @typedef {"main" | "filtered" | "without_markers"} StoredRun */

/** @typedef {Pick<import("../systems/index.js").System, "aids">} OfAids */

/** @type {StoredRun[]} */
export const STORED = ["main", "filtered", "without_markers"];

/**
 * A run by chosen aids has a name that says which: it stands in the address.
 * @param {OfAids} system
 * @param {string[]} aids
 */
export const runByAids = (system, aids) => `aids:${system.aids.filter((aid) => aids.includes(aid)).join("+")}`;

/**
 * @param {OfAids} system
 * @param {string} run
 * @returns {string[] | null} null for one that is no run by aids alone
 */
export function aidsOf(system, run) {
  if (!run.startsWith("aids:")) return null;
  const aids = run
    .slice(5)
    .split("+")
    .filter((aid) => system.aids.includes(aid));
  return aids.length > 0 ? aids : null;
}

/** A run of the laboratory by its id. @param {string} id */
export const labName = (id) => `lab:${id}`;

/** Whether a run is the walk's own. @param {string} run */
export const isOwn = (run) => /** @type {string[]} */ (STORED).includes(run);

/**
 * Of the runs of a walk the newest that stands for a name in the address.
 * @param {OfAids} system
 * @param {import("../lab/view.js").LabRun[]} runs
 * @param {string} name
 */
export function runNamed(system, runs, name) {
  const aids = aidsOf(system, name);
  return runs.findLast(
    (run) =>
      run.state === "finished" &&
      (aids
        ? run.solution === "filtered" &&
          Object.keys(run.parameters).length === 0 &&
          run.aids !== null &&
          runByAids(system, run.aids) === runByAids(system, aids)
        : labName(run.id) === name),
  );
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
