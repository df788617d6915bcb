// One walk from its creation to its track, by the client that is made from the description of the API. It is copied
// beside that client, and its types are checked there, before it is run.

import { createHash } from "node:crypto";
import { client, Refused } from "./client.mjs";

/** How long the server may take to work the walk out, ms. */
const WITHIN_MS = 300_000;

/**
 * @param {string} origin of the server
 * @param {Record<"left" | "right", Buffer<ArrayBuffer>>} logs
 */
export async function walk(origin, logs) {
  const api = client(origin);
  const { body: inspector } = await api.create_inspector({ body: { name: "Li Na" } });
  const { body: session, status } = await api.create_session({
    body: {
      inspector_id: inspector.id,
      title: "By a made client",
      streams: ["left", "right"],
      start: { position_m: [1, 2, 0] },
    },
  });
  if (status !== 201) throw new Error(`expected a new session, found ${status}`);

  for (const stream of /** @type {const} */ (["left", "right"])) {
    const bytes = new Uint8Array(logs[stream]);
    const half = bytes.length >> 1;
    const { body: log } = await api.begin_log({
      id: session.id,
      body: { stream, file_name: `${stream}.csv`, size_bytes: bytes.length },
    });
    // In two pieces, by the offset that the server tells.
    const first = await api.append_to_log({
      id: log.id,
      "Upload-Offset": log.offset_bytes,
      body: bytes.slice(0, half),
    });
    const at = Number(first.headers.get("Upload-Offset"));
    await api.append_to_log({ id: log.id, "Upload-Offset": at, body: bytes.slice(at) });
    const sha256 = createHash("sha256").update(bytes).digest("hex");
    const { body: finished } = await api.finish_log({ id: log.id, body: { sha256 } });
    if (finished.state !== "accepted") throw new Error(`${stream}: ${finished.state}`);
  }

  let { body: job } = await api.process_session({ id: session.id });
  const begun = Date.now();
  while (job.state === "queued" || job.state === "running") {
    if (Date.now() - begun > WITHIN_MS) throw new Error(`the job is still ${job.state} after ${WITHIN_MS} ms`);
    await new Promise((resolve) => setTimeout(resolve, 100));
    ({ body: job } = await api.get_job({ id: job.id }));
  }
  if (job.state !== "finished") throw new Error(`the job is ${job.state}: ${job.error}`);

  const { body: done } = await api.get_session({ id: session.id });
  const { body: track } = await api.get_track({ id: session.id, run: "main", rate_hz: "1" });
  const column = (/** @type {string} */ name) => track.rows.map((row) => row[track.columns.indexOf(name)]);
  const { body: csv } = await api.export_track_csv({ id: session.id });
  const { body: parameters } = await api.list_parameters({ system: "pedestrian" });
  return { session: done, e_m: column("e_m"), n_m: column("n_m"), csv, parameters: parameters.parameters.length };
}

/**
 * The code that a session of nobody is refused with. That it is one of those that are told is for the types to see.
 * @param {string} origin
 * @returns {Promise<import("./client.mjs").Problems["create_session"] | null>}
 */
export async function refusalOfNobody(origin) {
  try {
    await client(origin).create_session({ body: { inspector_id: "0199f3a0-7c1e-7d52-9b1a-4f6e2d8c3b57" } });
  } catch (error) {
    if (error instanceof Refused && error.code === "inspector_not_found") return error.code;
    throw error;
  }
  return null;
}
