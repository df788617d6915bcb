// An upload that was cut by a refresh or a closed page: which session and which logs it was.

import { recall, remember } from "../ui/remembered.js";

/**
 * @typedef {{session_id: string, system?: string, title: string, logs: Record<string, {log_id: string, sha256: string, name: string, size: number}>,
 *   waits?: boolean, who?: string, started_at?: string}} Unfinished
 *   `waits`: it was opened before, for this inspector at this time, and stays without its logs; its logs by stream; one from before there were several systems names none
 */

const KEY = "unfinished-upload";

/** @returns {Unfinished | null} */
export function unfinishedUpload() {
  try {
    const found = JSON.parse(recall(KEY) ?? "null");
    return found && typeof found.session_id === "string" && found.logs instanceof Object ? found : null;
  } catch {
    return null;
  }
}

/** @param {Unfinished | null} upload */
export function rememberUpload(upload) {
  remember(KEY, upload === null ? null : JSON.stringify(upload));
}
