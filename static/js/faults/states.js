// How a fault comes from its report to the check of its repair, and which steps people are offered.

/** @typedef {"open" | "acknowledged" | "in_work" | "fixed" | "verified"} FaultState */

export const STATES = /** @type {const} */ (["open", "acknowledged", "in_work", "fixed", "verified"]);

/** The steps that are offered, the likeliest first. @type {Record<FaultState, FaultState[]>} */
const STEPS = {
  open: ["acknowledged", "in_work", "fixed"],
  acknowledged: ["in_work", "fixed"],
  in_work: ["fixed", "acknowledged"],
  fixed: ["verified", "in_work"],
  verified: ["open"],
};

/** @param {string} state */
export const stepsFrom = (state) => STEPS[/** @type {FaultState} */ (state)] ?? [];

/** Whether it is still to be seen to. @param {{state: string}} fault */
export const stands = (fault) => fault.state !== "verified";

/**
 * Whether a fault passes the filters of the list.
 * @param {import("../state/live.js").Fault} fault
 * @param {{state: string, severity: string, assignee: string, text: string}} filter an empty word lets all pass
 * @param {string} words all that is shown of it, to be searched
 */
export function passes(fault, filter, words) {
  const is = { "": true, standing: stands(fault), to_be_placed: stands(fault) && !fault.position_m && !fault.marker };
  if (!(/** @type {Record<string, boolean>} */ (is)[filter.state] ?? filter.state === fault.state)) return false;
  if (filter.severity !== "" && filter.severity !== fault.severity) return false;
  if (
    filter.assignee === "nobody" ? fault.assignee_id : filter.assignee !== "" && filter.assignee !== fault.assignee_id
  )
    return false;
  return words.toLocaleLowerCase().includes(filter.text.trim().toLocaleLowerCase());
}
