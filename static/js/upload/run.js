// The whole of handing in: the session, each stream's log, the visits, then processing until it is done.

import { handIn } from "./transfer.js";

/**
 * @typedef {Record<string, File | undefined>} Files by stream
 * @typedef {import("./remembered_upload.js").Unfinished} Unfinished
 * @typedef {Pick<typeof import("../api.js"), "createSession" | "deleteSession" | "beginLog" | "logOffset" | "appendLog" | "finishLog" | "previewUpload" | "addVisits" | "processSession" | "job">} UploadApi
 */

/** How often a job is asked for when the feed says nothing, ms. */
const ASK_EVERY_MS = 700;

/**
 * @param {UploadApi} api
 * @param {import("../systems/index.js").System} system
 * @param {{
 *   files: Files, visits: File | null, session: Record<string, unknown>, unfinished: Unfinished | null,
 *   onLog: (stream: string, progress: import("./transfer.js").Progress) => void,
 *   onJob: (job: import("../state/live.js").Job) => void,
 *   remember: (unfinished: Unfinished | null) => void, wait?: (ms: number) => Promise<void>,
 *   readings?: Record<string, import("./preview.js").Reading>, dryRun?: boolean,
 * }} task a dry run sends the logs, looks at the whole of them and stores nothing
 * @returns {Promise<{session_id: string, unchanged: boolean, looked: Record<string, import("./preview.js").Preview>}>}
 */
export async function runUpload(api, system, task) {
  const wait = task.wait ?? ((ms) => new Promise((resolve) => setTimeout(resolve, ms)));
  const streams = system.uploadSlots.map(({ stream }) => stream).filter((stream) => task.files[stream]);
  /** @type {Unfinished} */
  const record = task.unfinished ?? {
    session_id: (await api.createSession({ ...task.session, ...system.sessionBody(streams) })).id,
    system: system.name,
    title: String(task.session.title ?? ""),
    logs: {},
  };
  task.remember(record);

  const outcomes = [];
  /** @type {Record<string, import("./preview.js").Preview>} */
  const looked = {};
  for (const stream of streams) {
    const file = /** @type {File} */ (task.files[stream]);
    const handedIn = handIn(api, {
      sessionId: record.session_id,
      stream: system.logBody(stream),
      file,
      begun: record.logs[stream] ?? null,
      onLog(log_id, sha256) {
        record.logs[stream] = { log_id, sha256, name: file.name, size: file.size };
        task.remember(record);
      },
      onProgress: (progress) => task.onLog(stream, progress),
      wait: task.wait,
      reading: task.readings?.[stream],
      dryRun: task.dryRun,
    });
    try {
      const { state, preview } = await handedIn;
      outcomes.push(state);
      if (preview) looked[stream] = preview;
    } catch (/** @type {any} */ error) {
      // What the server has refused it does not keep: there is nothing of this log to go on with.
      if (error.status >= 400 && error.status < 500) {
        delete record.logs[stream];
        const empty = task.unfinished === null && outcomes.length === 0;
        // A walk that was begun for it and holds nothing goes, too; one that waited for its logs stays.
        const gone =
          empty &&
          (await api.deleteSession(record.session_id).then(
            () => true,
            () => false,
          ));
        task.remember(gone ? null : record);
      }
      throw error;
    }
  }
  const unchanged = outcomes.every((state) => state === "unchanged");
  if (task.dryRun) return { session_id: record.session_id, unchanged, looked };
  if (task.visits) await api.addVisits(record.session_id, task.visits);

  let job = await api.processSession(record.session_id);
  task.onJob(job);
  while (!ended(job)) {
    await wait(ASK_EVERY_MS);
    job = await api.job(job.id);
    task.onJob(job);
  }
  if (job.state === "failed") throw Object.assign(new Error(jobError(job)), { job });
  task.remember(null);
  return { session_id: record.session_id, unchanged, looked };
}

/** @param {import("../state/live.js").Job} job */
export function ended(job) {
  return job.state === "finished" || job.state === "failed";
}

/** @param {import("../state/live.js").Job} job */
function jobError(job) {
  const error = /** @type {any} */ (job.error);
  return typeof error === "string" ? error : (error?.detail ?? error?.title ?? "processing failed");
}
