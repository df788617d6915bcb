// Hands one stream's log in: hash, begin, append from where the server is, finish. A cut or a refresh in
// the middle costs only the piece that was under way.

import { sha256OfFile } from "./sha256.js";

/** Bytes in one request: small enough to repeat, large enough not to wait on round trips. */
export const PIECE_BYTES = 4 << 20;
/** Waits between tries after a cut, ms; the last one repeats. */
const WAITS_MS = [500, 1000, 2000, 5000, 10_000];
/** About ten minutes without a server, then a person should look. */
const MOST_TRIES = 65;

/**
 * @typedef {{stage: "hashing" | "sending" | "waiting" | "checking" | "looking" | "looked" | "accepted" | "unchanged", done: number, total: number}} Progress
 * @typedef {Pick<typeof import("../api.js"), "beginLog" | "logOffset" | "appendLog" | "finishLog" | "previewUpload">} LogApi
 * @typedef {import("./preview.js").Reading} Reading
 */

/**
 * @typedef {{
 *   sessionId: string, stream: Record<string, unknown>, file: File, begun?: {log_id: string, sha256: string} | null,
 *   onLog?: (logId: string, sha256: string) => void, onProgress?: (progress: Progress) => void,
 *   wait?: (ms: number) => Promise<void>, unreachable?: (error: unknown) => boolean, reading?: Reading, dryRun?: boolean,
 * }} Task `stream` is what the server is told of it; `begun` is the log of an earlier try, to be gone on with when the file is the same; a dry run ends
 *   before the log is finished, with what the whole of it would be read as
 */

/**
 * @param {LogApi} api
 * @param {Task} task
 * @returns {Promise<{state: "accepted" | "unchanged" | "looked", log: any, preview?: import("./preview.js").Preview}>}
 */
export async function handIn(api, task) {
  const { file } = task;
  const tell = task.onProgress ?? (() => {});
  const total = file.size;
  const sha256 = await sha256OfFile(file, (done) => tell({ stage: "hashing", done, total }));

  const { log: begun, offset: start } = await begin(api, task, sha256);
  if (begun.state === "unchanged" || begun.state === "accepted") {
    tell({ stage: "unchanged", done: total, total });
    return { state: "unchanged", log: begun };
  }
  task.onLog?.(begun.id, sha256);

  let offset = start;
  while (offset < total) {
    tell({ stage: "sending", done: offset, total });
    const from = offset;
    offset = await persist(task, total, async (again) => {
      // After a cut the server may have written more than it could still say.
      const at = again ? await api.logOffset(begun.id) : from;
      if (at >= total) return at;
      try {
        return await api.appendLog(begun.id, at, file.slice(at, at + PIECE_BYTES));
      } catch (/** @type {any} */ error) {
        if (error.status === 409 && Number.isFinite(error.uploadOffset)) return error.uploadOffset;
        throw error;
      }
    });
  }
  if (task.dryRun) {
    tell({ stage: "looking", done: total, total });
    const preview = await persist(task, total, () => api.previewUpload(begun.id, task.reading ?? {}));
    tell({ stage: "looked", done: total, total });
    return { state: "looked", log: begun, preview };
  }
  tell({ stage: "checking", done: total, total });
  const log = await persist(task, total, () => api.finishLog(begun.id, sha256, task.reading));
  const state = log.state === "unchanged" ? "unchanged" : "accepted";
  tell({ stage: state, done: total, total });
  return { state, log };
}

/**
 * Goes on with the log of an earlier try, or begins one.
 * @param {LogApi} api
 * @param {Task} task
 * @param {string} sha256
 * @returns {Promise<{log: any, offset: number}>}
 */
async function begin(api, task, sha256) {
  const { file, stream, sessionId, begun } = task;
  if (begun && begun.sha256 === sha256) {
    try {
      const offset = await persist(task, file.size, () => api.logOffset(begun.log_id));
      return { log: { id: begun.log_id, state: "receiving" }, offset };
    } catch (/** @type {any} */ error) {
      // The server has dropped it since: begin anew.
      if (error.status !== 404) throw error;
    }
  }
  const log = await persist(task, file.size, () =>
    api.beginLog(sessionId, {
      ...stream,
      file_name: file.name,
      size_bytes: file.size,
      sha256,
      ...(task.reading ? { reading: task.reading } : {}),
    }),
  );
  const offset = log.state === "unchanged" ? 0 : await persist(task, file.size, () => api.logOffset(log.id));
  return { log, offset };
}

/**
 * Does something, and again for as long as the server cannot be reached.
 * @template T
 * @param {Task} task
 * @param {number} total
 * @param {(again: boolean) => Promise<T>} run
 * @returns {Promise<T>}
 */
async function persist(task, total, run) {
  const wait = task.wait ?? ((ms) => new Promise((resolve) => setTimeout(resolve, ms)));
  const unreachable = task.unreachable ?? ((error) => /** @type {any} */ (error).status === undefined);
  for (let tries = 0; ; tries++) {
    try {
      return await run(tries > 0);
    } catch (/** @type {any} */ error) {
      const passing = unreachable(error) || error.status === 502 || error.status === 503 || error.status === 504;
      if (!passing || tries >= MOST_TRIES) throw error;
      task.onProgress?.({ stage: "waiting", done: 0, total });
      await wait(WAITS_MS[Math.min(tries, WAITS_MS.length - 1)]);
    }
  }
}

/** Of two files of one size, so much at either end tells whether they are one. */
const COMPARED_BYTES = 64 << 10;

/**
 * Whether two logs are the same: two recordings of one size differ in their first samples already.
 * @param {File} one
 * @param {File} other
 */
export async function sameFile(one, other) {
  if (one.size !== other.size) return false;
  for (const from of [0, Math.max(0, one.size - COMPARED_BYTES)]) {
    const [a, b] = await Promise.all([one, other].map((file) => file.slice(from, from + COMPARED_BYTES).arrayBuffer()));
    const [x, y] = [new Uint8Array(a), new Uint8Array(b)];
    if (x.some((byte, i) => byte !== y[i])) return false;
  }
  return true;
}
