// Waiting for a run of the laboratory.

import * as api from "../api.js";

/** How often it is asked for, ms. */
const EVERY_MS = 400;

/**
 * @param {string} id
 * @returns {Promise<import("./view.js").LabRun>} the run, once it is computed; why it was not is thrown
 */
export async function untilDone(id) {
  for (;;) {
    const run = await api.labRun(id);
    if (run.state === "finished") return run;
    if (run.state === "failed" || run.state === "cancelled") throw new Error(run.error ?? run.state);
    await new Promise((resolve) => setTimeout(resolve, EVERY_MS));
  }
}
