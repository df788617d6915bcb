// The network: one function for each endpoint of docs/wire.md. Errors are thrown, never swallowed.

const BASE = "/api/v1";

/** An error answer of the server, as its problem document tells it. */
export class Problem extends Error {
  /**
   * @param {number} status
   * @param {{title?: string, detail?: string, code?: string, where?: Record<string, unknown> | string, current?: unknown}} body
   */
  constructor(status, body) {
    super(body.detail ?? body.title ?? `HTTP ${status}`);
    this.name = "Problem";
    this.status = status;
    this.code = body.code ?? "";
    this.title = body.title ?? "";
    this.where = body.where ?? null;
    /** What stands now, where somebody else has changed it meanwhile. */
    this.current = body.current ?? null;
  }
}

/** The server could not be reached at all; trying again later may help. */
export class Unreachable extends Error {}

/**
 * @param {string} path
 * @param {RequestInit} [init]
 * @returns {Promise<Response>}
 */
async function request(path, init) {
  let response;
  try {
    response = await fetch(BASE + path, init);
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Unreachable(String(error));
  }
  if (response.ok) return response;
  let body = {};
  try {
    body = await response.json();
  } catch {
    // A proxy in between answers in HTML: the status says enough.
  }
  const problem = new Problem(response.status, body);
  // A sign-in that has ended: the page asks for a new one. (A wrong password is no such thing.)
  if (problem.code === "not_signed_in") dispatchEvent(new Event("signed-out"));
  // The right offset of a log that was appended to at a wrong one.
  const offset = response.headers.get("Upload-Offset");
  if (offset !== null) Object.assign(problem, { uploadOffset: Number(offset) });
  throw problem;
}

/** @param {string} path */
async function get(path) {
  return (await request(path)).json();
}

/**
 * All pages of a list that the server answers a page at a time.
 * @param {string} path
 * @returns {Promise<any[]>}
 */
async function getAll(path) {
  const rows = [];
  for (let next = path; next;) {
    const response = await request(next);
    rows.push(...(await response.json()));
    next = response.headers.get("Link")?.match(/<\/api\/v1([^>]*)>; rel="next"/)?.[1] ?? "";
  }
  return rows;
}

/**
 * @param {string} path
 * @param {unknown} [body]
 */
const post = (path, body) => send("POST", path, body);

/**
 * @param {string} method
 * @param {string} path
 * @param {unknown} [body]
 */
async function send(method, path, body) {
  const response = await request(path, {
    method,
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body ?? {}),
  });
  return response.status === 204 ? null : response.json();
}

/** @param {string} id */
const seg = (id) => encodeURIComponent(id);

/**
 * @typedef {{has_accounts: boolean, known: boolean, id: string | null, name: string | null, role: string | null, rights: string[], inspector_id: string | null}} Me
 * @typedef {{id: string, name: string, role: string, inspector_id: string | null, disabled: boolean, expires_at: string | null, created_at: string}} Account
 * @typedef {{id: string, address: string, agent: string, created_at: string, seen_at: string}} SignIn
 * @typedef {{id: string, account_id: string, name: string, rights: string[], inspector_id: string | null, created_at: string, expires_at: string | null, used_at: string | null, revoked_at: string | null}} Token
 * @typedef {{id: number, at: string, who: string, address: string, action: string, subject: string, before: any, after: any}} AuditEntry
 */
/** @returns {Promise<any>} the description of the API */
export const openapi = () => get("/openapi.json");
/** @returns {Promise<Me>} */
export const account = () => get("/account");
/** @param {{setup_token: string, name: string, password: string}} body */
export const setUp = (body) => post("/account/set-up", body);
/** @param {{name: string, password: string}} body */
export const signIn = (body) => post("/account/sign-in", body);
export const signOut = () => post("/account/sign-out");
/** @param {{old: string, new: string}} body */
export const changePassword = (body) => post("/account/password", body);
/** @returns {Promise<SignIn[]>} */
export const signIns = () => get("/account/sign-ins").then(rows);
/** @param {string} id */
export const endSignIn = (id) => request(`/account/sign-ins/${seg(id)}`, { method: "DELETE" });
/** @returns {Promise<Account[]>} */
export const accounts = () => get("/accounts").then(rows);
/** @param {Record<string, unknown>} body */
export const addAccount = (body) => post("/accounts", body);
/**
 * @param {string} id
 * @param {Record<string, unknown>} change
 */
export const changeAccount = (id, change) => send("PATCH", `/accounts/${seg(id)}`, change);
/** @param {string} id */
export const removeAccount = (id) => request(`/accounts/${seg(id)}`, { method: "DELETE" });
/** @returns {Promise<Token[]>} */
export const tokens = (all = false) => get(`/tokens?all=${all}`).then(rows);
/** @param {Record<string, unknown>} body @returns {Promise<Token & {secret: string}>} */
export const makeToken = (body) => post("/tokens", body);
/** @param {string} id */
export const revokeToken = (id) => request(`/tokens/${seg(id)}`, { method: "DELETE" });
/** @param {URLSearchParams} query @returns {Promise<AuditEntry[]>} */
export const audit = (query) => get(`/audit?${query}`).then(rows);
/** @param {URLSearchParams} query */
export const auditFile = (query) => `${BASE}/audit.csv?${query}`;
/** @returns {Promise<{version: string, started_at: string, database_bytes: number, free_bytes: number | null, sessions: number, last_backup_at: string | null}>} */
export const server = () => get("/server");
/** @returns {Promise<{file: string, bytes: number}>} */
export const backUp = () => post("/backups");
/** @returns {Promise<import("./admin/webhooks.js").Webhook[]>} */
export const webhooks = () => get("/webhooks").then(rows);
/** @param {Record<string, unknown>} body @returns {Promise<{secret: string}>} */
export const addWebhook = (body) => post("/webhooks", body);
/**
 * @param {string} id
 * @param {Record<string, unknown>} change with the version that was seen
 */
export const changeWebhook = (id, change) => send("PATCH", `/webhooks/${seg(id)}`, change);
/** @param {string} id */
export const removeWebhook = (id) => request(`/webhooks/${seg(id)}`, { method: "DELETE" });
/** @param {string} id @returns {Promise<{secret: string}>} */
export const renewWebhookSecret = (id) => post(`/webhooks/${seg(id)}/secret`);
/** @param {string} id */
export const testWebhook = (id) => post(`/webhooks/${seg(id)}/test`);
/** @param {string} id @returns {Promise<import("./admin/webhooks.js").Delivery[]>} */
export const webhookDeliveries = (id) => get(`/webhooks/${seg(id)}/deliveries`).then(rows);
/**
 * @param {string} id
 * @param {number} number of the delivery
 */
export const sendAgain = (id, number) => post(`/webhooks/${seg(id)}/deliveries/${number}/again`);
/** @returns {Promise<any[]>} */
export const jobs = () => get("/jobs").then(rows);

export const site = () => get("/site");
/** @returns {Promise<{systems: import("./systems/generic.js").Declaration[]}>} */
export const systems = () => get("/systems");
export const sitePlan = () => get("/site/plan");
export const inspectors = () => get("/inspectors").then(rows);
/** @param {string} name @param {string} kind What it is: a person, or as a system says. */
export const createInspector = (name, kind) => post("/inspectors", { name, kind });

/** @param {URLSearchParams} query @returns {Promise<import("./sessions/search.js").Page>} */
export const searchSessions = (query) => get(`/sessions/search?${query}`);
/** @param {string} id @returns {Promise<{starred: boolean, note: string}>} */
export const sessionNote = (id) => get(`/sessions/${seg(id)}/note`);
/**
 * @param {string} id
 * @param {{starred: boolean, note: string}} note
 */
export const setSessionNote = (id, note) => send("PUT", `/sessions/${seg(id)}/note`, note);
export const sessions = () => get("/sessions").then(rows);
/** @param {URLSearchParams} query what is known of the log @returns {Promise<import("./upload/waiting.js").WaitingWalk[]>} */
export const waitingSessions = (query) => get(`/sessions/waiting?${query}`).then(rows);
/** @param {string} at @returns {Promise<import("./state/past.js").Moment>} where everybody was */
export const moment = (at) => get(`/moment?at=${encodeURIComponent(at)}`);
/** @returns {Promise<{lost_after_s: number, standing_after_s: number, gone_after_s: number}>} */
export const alarms = () => get("/alarms");
/** @typedef {{key: string, acknowledged_at: string, acknowledged_by: string}} Acknowledged */
/** @returns {Promise<Acknowledged[]>} */
export const alarmsAcknowledged = () => get("/alarms/acknowledged").then(rows);
/** @param {string} key @returns {Promise<Acknowledged>} */
export const acknowledgeAlarm = (key) => post("/alarms/acknowledged", { key });
/** @param {string} id */
export const endSession = (id) => post(`/sessions/${seg(id)}/end`);
/** @param {string} sha256 @returns {Promise<import("./upload/waiting.js").KnownLog[]>} */
export const knownLogs = (sha256) => get(`/known-logs?sha256=${sha256}`).then(rows);
/** @param {string} id */
export const session = (id) => get(`/sessions/${seg(id)}`);
/** @param {Record<string, unknown>} body */
export const createSession = (body) => post("/sessions", body);
/** @param {string} id */
export const deleteSession = (id) => request(`/sessions/${seg(id)}`, { method: "DELETE" });
/** @param {string} id */
export const visits = (id) => get(`/sessions/${seg(id)}/visits`).then(rows);
/** @param {string} id @returns {Promise<import("./sessions/report.js").Report>} */
export const report = (id) => get(`/sessions/${seg(id)}/report`);
/** @param {string} id */
export const stands = (id) => get(`/sessions/${seg(id)}/stands`).then(rows);
/**
 * @param {string} id
 * @param {number} stand
 * @param {string} marker
 */
export const chooseMarker = (id, stand, marker) =>
  send("PUT", `/sessions/${seg(id)}/stands/${stand}/choice`, { marker });
/**
 * @param {string} id
 * @param {number} stand
 */
export const takeChoiceBack = (id, stand) =>
  request(`/sessions/${seg(id)}/stands/${stand}/choice`, { method: "DELETE" });
/**
 * What is left out stays.
 * @param {string} id
 * @param {{automatic_visits?: boolean, title?: string, inspector_id?: string, start?: {marker: string} | null,
 *   clock_offset_s?: number | null, excluded?: boolean}} change
 */
export const changeSession = (id, change) => send("PATCH", `/sessions/${seg(id)}`, change);
/** @param {string} id */
export const anomalies = (id) => get(`/sessions/${seg(id)}/anomalies`).then(rows);
/**
 * @param {string} id
 * @param {"main" | "filtered" | "without_markers"} run
 * @param {number} rate_hz
 */
export const track = (id, run, rate_hz) => get(`/sessions/${seg(id)}/track?run=${run}&rate_hz=${rate_hz}`);
/**
 * A stretch of a run with every point that is stored.
 * @param {string} id
 * @param {"main" | "filtered" | "without_markers"} run
 * @param {number} from_s
 * @param {number} to_s
 */
export const trackBetween = (id, run, from_s, to_s) =>
  get(`/sessions/${seg(id)}/track?run=${run}&from_s=${from_s}&to_s=${to_s}`);
/**
 * A lab run's track.
 * @param {string} id
 * @param {string} runId
 * @param {number} rate_hz
 */
export const labTrack = (id, runId, rate_hz) => get(`/sessions/${seg(id)}/track?run=${seg(runId)}&rate_hz=${rate_hz}`);
/**
 * @param {string} id
 * @param {import("./replay/clock.js").Stretch | null} stretch null: the whole walk
 * @param {number} buckets
 * @param {string[]} names
 * @returns {Promise<import("./replay/lines.js").Charts>}
 */
export const charts = (id, stretch, buckets, names) =>
  get(
    `/sessions/${seg(id)}/charts?${stretch ? `from_s=${stretch[0]}&to_s=${stretch[1]}&` : ""}buckets=${buckets}&charts=${names.join(",")}`,
  );
/**
 * @param {string} id
 * @param {string} format
 */
export const trackFile = (id, format) => `${BASE}/sessions/${seg(id)}/track.${format}`;

/**
 * @param {string} sessionId
 * @param {{file_name: string, size_bytes: number, sha256: string, reading?: import("./upload/preview.js").Reading}} body and which stream it is of, as its system says it
 */
export const beginLog = (sessionId, body) => post(`/sessions/${seg(sessionId)}/logs`, body);
/**
 * @param {string} logId
 * @returns {Promise<number>} bytes that the server holds
 */
export async function logOffset(logId) {
  const response = await request(`/logs/${seg(logId)}`, { method: "HEAD" });
  return Number(response.headers.get("Upload-Offset"));
}
/**
 * @param {string} logId
 * @param {number} offset
 * @param {Blob} bytes
 * @returns {Promise<number>} the new offset
 */
export async function appendLog(logId, offset, bytes) {
  const response = await request(`/logs/${seg(logId)}`, {
    method: "PATCH",
    headers: { "Content-Type": "application/offset+octet-stream", "Upload-Offset": String(offset) },
    body: bytes,
  });
  return Number(response.headers.get("Upload-Offset") ?? offset + bytes.size);
}
/**
 * @param {string} logId
 * @param {string} sha256
 * @param {import("./upload/preview.js").Reading} [reading]
 */
export const finishLog = (logId, sha256, reading) =>
  post(`/logs/${seg(logId)}/finish`, { sha256, ...(reading ? { reading } : {}) });
/**
 * What a log, or its beginning, would be read as; nothing is kept.
 * @param {Blob} bytes
 * @param {boolean} part whether more follows
 * @param {import("./upload/preview.js").Reading} reading
 * @returns {Promise<import("./upload/preview.js").Preview>}
 */
export async function previewLog(bytes, part, reading) {
  const query = new URLSearchParams({ part: String(part), reading: JSON.stringify(reading) });
  const response = await request(`/logs/preview?${query}`, {
    method: "POST",
    headers: { "Content-Type": "application/octet-stream" },
    body: bytes,
  });
  return response.json();
}
/**
 * @param {string} logId
 * @param {import("./upload/preview.js").Reading} reading
 * @returns {Promise<import("./upload/preview.js").Preview>}
 */
export const previewUpload = (logId, reading) => post(`/logs/${seg(logId)}/preview`, { reading });
/** @returns {Promise<import("./upload/preview.js").NamedMapping[]>} */
export const mappings = () => get("/mappings").then(rows);
/**
 * @param {string} name
 * @param {import("./upload/preview.js").Mapping} mapping
 * @returns {Promise<import("./upload/preview.js").NamedMapping>}
 */
export const saveMapping = (name, mapping) => post("/mappings", { name, mapping });
/** @param {string} id */
export const deleteMapping = (id) => request(`/mappings/${seg(id)}`, { method: "DELETE" });
/**
 * @param {string} sessionId
 * @param {Blob} csv
 */
export const addVisits = (sessionId, csv) =>
  request(`/sessions/${seg(sessionId)}/visits`, {
    method: "POST",
    headers: { "Content-Type": "text/csv" },
    body: csv,
  });
/**
 * @param {string} sessionId
 * @param {{marker: string, t_start_s: number, t_end_s: number}[]} visits
 */
export const tellVisits = (sessionId, visits) => post(`/sessions/${seg(sessionId)}/visits`, visits);
/**
 * @param {string} sessionId
 * @param {Record<string, unknown>} visit
 */
export const addVisit = (sessionId, visit) => post(`/sessions/${seg(sessionId)}/visits`, visit);
/**
 * @param {string} sessionId
 * @param {string} visitId
 */
export const takeVisitBack = (sessionId, visitId) =>
  request(`/sessions/${seg(sessionId)}/visits/${seg(visitId)}`, { method: "DELETE" });
/** @param {string} sessionId */
export const processSession = (sessionId) => post(`/sessions/${seg(sessionId)}/process`);
/** @param {string} id */
export const job = (id) => get(`/jobs/${seg(id)}`);

/** @returns {Promise<{engine_version: string, engine_sha256: string, parameters: import("./lab/parameters.js").Parameter[]}>} */
export const labParameters = () => get("/lab/parameters");
/** @returns {Promise<import("./lab/site.js").SiteParameters>} */
export const siteParameters = () => get("/lab/site-parameters");
/**
 * @param {{parameter_set_id: string | null, version?: number}} choice
 * @returns {Promise<import("./lab/site.js").SiteParameters>}
 */
export const chooseSiteParameters = (choice) => send("PUT", "/lab/site-parameters", choice);
export const siteParametersFile = "/api/v1/lab/site-parameters.json";
/** @returns {Promise<import("./lab/parameters.js").ParameterSet[]>} */
export const parameterSets = () => get("/lab/parameter-sets").then(rows);
/** @param {Record<string, unknown>} body */
export const addParameterSet = (body) => post("/lab/parameter-sets", body);
/**
 * @param {string} id
 * @param {Record<string, unknown>} body with the version that was seen
 */
export const changeParameterSet = (id, body) => send("PUT", `/lab/parameter-sets/${seg(id)}`, body);
/** @param {string} id */
export const removeParameterSet = (id) => request(`/lab/parameter-sets/${seg(id)}`, { method: "DELETE" });
/** @param {string} [sessionId] all, when it is left out @returns {Promise<import("./lab/view.js").LabRun[]>} */
export const labRuns = (sessionId) => get(`/lab/runs${sessionId ? `?session_id=${seg(sessionId)}` : ""}`).then(rows);
/** @param {string} id @returns {Promise<import("./lab/view.js").LabRun>} */
export const labRun = (id) => get(`/lab/runs/${seg(id)}`);
/** @param {Record<string, unknown>} body @returns {Promise<import("./lab/view.js").LabRun[]>} */
export const startLabRuns = (body) => post("/lab/runs", body);
/** @param {string} id */
export const cancelLabRun = (id) => post(`/lab/runs/${seg(id)}/cancel`);
/** @param {string} id */
export const removeLabRun = (id) => request(`/lab/runs/${seg(id)}`, { method: "DELETE" });
/** @param {string[]} ids of walks @returns {Promise<import("./lab/comparison.js").Comparison>} */
export const labComparison = (ids) => get(`/lab/comparison?session_ids=${ids.map(seg).join(",")}`);
/** @param {string[]} ids of walks */
export const labComparisonFile = (ids) => `${BASE}/lab/comparison.csv?session_ids=${ids.map(seg).join(",")}`;

export const markers = () => get("/markers").then(rows);
export const markersFile = `${BASE}/markers.csv`;
/** @param {Record<string, unknown>} body */
export const addMarker = (body) => post("/markers", body);
/**
 * @param {string} name
 * @param {Record<string, unknown>} body with the version that was seen
 */
export const putMarker = (name, body) => send("PUT", `/markers/${seg(name)}`, body);
/**
 * @param {string} name
 * @param {number} version that was seen
 * @param {string} reason
 */
export const removeMarker = (name, version, reason) =>
  request(`/markers/${seg(name)}?version=${version}&reason=${seg(reason)}`, { method: "DELETE" });
/** @param {string} name @returns {Promise<import("./markers/record.js").MarkerChange[]>} */
export const markerHistory = (name) => get(`/markers/${seg(name)}/history`);
/** @param {string} name @returns {Promise<import("./markers/record.js").VisitResidual[]>} */
export const markerResiduals = (name) => get(`/markers/${seg(name)}/residuals`);
export const residuals = () => get("/markers/residuals");

/** @returns {Promise<import("./markers/files.js").Import[]>} */
export const markerImports = () => get("/markers/imports");
/** @param {string} id @returns {Promise<import("./markers/files.js").ImportView>} */
export const importOfSurvey = (id) => post(`/sessions/${seg(id)}/marker-import`, {});
/** @param {string} id @returns {Promise<any[]>} */
export const surveyedPoints = (id) => get(`/sessions/${seg(id)}/surveyed-points`);
/** @param {string} id @returns {Promise<import("./markers/files.js").ImportView>} */
export const markerImport = (id) => get(`/markers/imports/${seg(id)}`);
/**
 * @param {Blob} csv
 * @param {string} file_name
 * @returns {Promise<import("./markers/files.js").ImportView>} what it would change; nothing is changed yet
 */
export async function sendImport(csv, file_name) {
  const response = await request(`/markers/imports?file_name=${seg(file_name)}`, {
    method: "POST",
    headers: { "Content-Type": "text/csv" },
    body: csv,
  });
  return response.json();
}
/**
 * @param {string} id
 * @param {{mapping: unknown, whole_table: boolean}} reading
 */
export const readImport = (id, reading) => send("PUT", `/markers/imports/${seg(id)}/reading`, reading);
/**
 * @param {string} id
 * @param {Record<string, unknown>} body
 */
export const applyImport = (id, body) => post(`/markers/imports/${seg(id)}/apply`, body);
/**
 * @param {string} id
 * @param {Record<string, unknown>} body
 */
export const revertImport = (id, body) => post(`/markers/imports/${seg(id)}/revert`, body);
/** @param {string} id */
export const giveUpImport = (id) => request(`/markers/imports/${seg(id)}`, { method: "DELETE" });

/** @param {string} [state] */
export const faults = (state) => getAll(`/faults${state ? `?state=${seg(state)}` : ""}`);
/** @param {Record<string, unknown>} body */
export const reportFault = (body) => post("/faults", body);
/** @param {string} id */
export const fault = (id) => get(`/faults/${seg(id)}`);
/**
 * @param {string} id
 * @param {Record<string, unknown>} body with the version that was seen
 */
export const changeFault = (id, body) => send("PATCH", `/faults/${seg(id)}`, body);
/** @param {string} id @returns {Promise<import("./faults/record.js").FaultChange[]>} */
export const faultHistory = (id) => get(`/faults/${seg(id)}/history`);
/** @param {string} id @returns {Promise<import("./faults/details.js").Helper[]>} */
export const nearestInspectors = (id) => get(`/faults/${seg(id)}/nearest`);
/** @param {string} id @returns {Promise<import("./faults/record.js").Photo[]>} */
export const faultPhotos = (id) => get(`/faults/${seg(id)}/photos`);
/**
 * @param {string} id
 * @param {File} photo
 */
export const addPhoto = (id, photo) =>
  request(`/faults/${seg(id)}/photos`, {
    method: "POST",
    headers: { "Content-Type": photo.type || "application/octet-stream" },
    body: photo,
  });
/**
 * @param {string} id
 * @param {string} photoId
 */
export const removePhoto = (id, photoId) => request(`/faults/${seg(id)}/photos/${seg(photoId)}`, { method: "DELETE" });
/**
 * @param {string} id
 * @param {string} photoId
 */
export const photoUrl = (id, photoId) => `${BASE}/faults/${seg(id)}/photos/${seg(photoId)}`;

export const feedUrl = () => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${BASE}/feed`;

/**
 * A list comes bare or in an envelope named after it.
 * @param {any} body
 * @returns {any[]}
 */
function rows(body) {
  if (Array.isArray(body)) return body;
  const list = Object.values(body).find(Array.isArray);
  if (!list) throw new Error("expected a list");
  return list;
}
