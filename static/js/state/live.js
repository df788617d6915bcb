// What the page knows of the site right now: plain data, and one function that applies a message of the
// feed to it. Runs anywhere; the tests run it without a browser.

import { extend, revise } from "./trail.js";

/**
 * @typedef {import("./trail.js").TrailPoint} TrailPoint
 * @typedef {import("./findings.js").Visit} Visit
 * @typedef {import("./findings.js").Anomaly} Anomaly
 * @typedef {import("./findings.js").Stand} Stand
 * @typedef {{id: string, name: string, kind?: string}} Inspector
 * @typedef {{
 *   kind?: string, session_id?: string, inspector_id?: string, t_ns: number,
 *   position_m: [number, number, number], heading_rad: number | null, sigma_heading_rad?: number | null,
 *   sigma_m: [number, number, number], covariance_en_m2: number, speed_m_s: number,
 *   state: string, since_marker_s: number | null, since_marker_m: number | null, distance_m: number,
 *   received_at: string,
 * }} Position
 * @typedef {{
 *   id: string, inspector_id?: string | null, session_id?: string | null, kind: string, severity: "low" | "medium" | "high",
 *   text?: string | null, marker?: string | null, state: string, assignee_id?: string | null, photos?: number, version?: number,
 *   reported_at: string, closed_at?: string | null,
 *   position_m: [number, number, number] | null, sigma_m: [number, number, number] | null,
 *   candidates: {marker: string | null, probability: number, distance_m: number | null}[],
 * }} Fault a candidate without a marker stands for none of those named
 * @typedef {{
 *   id: string, inspector_id: string, title?: string | null, state: string, started_at: string | null, ended_at?: string | null,
 *   system?: string, position: Position | null, trail: TrailPoint[], revised_from_ns: number, visits: Visit[], stands: Stand[], anomalies: Anomaly[],
 * }} LiveSession `revised_from_ns` is the earliest time that was revised since the map last drew the past
 * @typedef {{id: string, session_id: string, lab_run_id?: string, state: string, stage: string, progress: number, error?: unknown}} Job
 * @typedef {{
 *   boot: string | null, seq: number, server_offset_ms: number, heard_at_ms: number,
 *   inspectors: Map<string, Inspector>, sessions: Map<string, LiveSession>, faults: Map<string, Fault>, acknowledged: Map<string, import("../api.js").Acknowledged>,
 *   alarms: Map<string, RaisedAlarm>, lost_after_s: number, gone_after_s: number,
 *   jobs: Map<string, Job>, markers_revision: number,
 * }} LiveState
 * @typedef {{key: string, kind: "lost" | "standing" | "fault", session_id: string | null, inspector_id: string | null, fault_id: string | null, since: string, raised_at: string}} RaisedAlarm
 * @typedef {"all" | "position" | "trail" | "session" | "visit" | "stand" | "anomaly" | "fault" | "markers" | "job"} Topic
 */

/** How many of the latest anomalies, visits and stands of a live session are kept to be shown. */
const KEPT = 50;

/** No word for this long: lost. */
export const LOST_AFTER_S = 60;
/** No word for this long: the walk counts as left without an end. */
export const GONE_AFTER_S = 3600;

/** @returns {LiveState} */
export function emptyState() {
  return {
    boot: null,
    seq: 0,
    server_offset_ms: 0,
    heard_at_ms: 0,
    inspectors: new Map(),
    sessions: new Map(),
    faults: new Map(),
    jobs: new Map(),
    acknowledged: new Map(),
    alarms: new Map(),
    // Until the server has said what it was set to.
    lost_after_s: LOST_AFTER_S,
    gone_after_s: GONE_AFTER_S,
    markers_revision: 0,
  };
}

/**
 * Applies one message of the feed.
 * @param {LiveState} state
 * @param {any} message
 * @param {number} now_ms this machine's clock
 * @returns {{gap: boolean, changed: Set<Topic>}} `gap`: messages were missed, ask for a snapshot
 */
export function apply(state, message, now_ms) {
  /** @type {Set<Topic>} */
  const changed = new Set();
  state.heard_at_ms = now_ms;
  if (message.server_time) state.server_offset_ms = Date.parse(message.server_time) - now_ms;
  switch (message.type) {
    case "snapshot":
      takeSnapshot(state, message);
      changed.add("all");
      return { gap: false, changed };
    case "changes":
      if (message.seq <= state.seq) return { gap: false, changed };
      if (message.seq !== state.seq + 1) return { gap: true, changed };
      state.seq = message.seq;
      for (const change of message.changes) applyChange(state, change, changed);
      return { gap: false, changed };
    case "heartbeat":
      return { gap: message.seq > state.seq, changed };
    default:
      return { gap: false, changed };
  }
}

/**
 * @param {LiveState} state
 * @param {any} message
 */
function takeSnapshot(state, message) {
  state.boot = message.boot;
  state.seq = message.seq;
  state.markers_revision = message.markers_revision ?? 0;
  state.inspectors = new Map(message.inspectors.map((/** @type {Inspector} */ i) => [i.id, i]));
  state.sessions = new Map(message.sessions.map((/** @type {any} */ s) => [s.id, liveSession(s)]));
  state.faults = new Map(message.faults.map((/** @type {Fault} */ f) => [f.id, f]));
  state.alarms = new Map((message.alarms ?? []).map((/** @type {RaisedAlarm} */ a) => [a.key, a]));
}

/** Those who are people: instruments are positioned too. @param {LiveState} live */
export const inspectorsOf = (live) => [...live.inspectors.values()].filter(({ kind = "person" }) => kind === "person");

/**
 * @param {any} row a session as the server tells it
 * @returns {LiveSession}
 */
function liveSession(row) {
  return {
    ...row,
    position: row.position ?? null,
    trail: row.trail ?? [],
    revised_from_ns: Infinity,
    visits: row.visits instanceof Array ? row.visits : [],
    stands: row.stands instanceof Array ? row.stands : [],
    anomalies: row.anomalies instanceof Array ? row.anomalies : [],
  };
}

/**
 * @param {LiveState} state
 * @param {any} change
 * @param {Set<Topic>} changed
 */
function applyChange(state, change, changed) {
  const session = change.session_id ? state.sessions.get(change.session_id) : undefined;
  switch (change.kind) {
    case "position": {
      const target = session ?? newcomer(state, change);
      target.position = change;
      extend(target.trail, [change.t_ns, change.position_m[0], change.position_m[1]]);
      changed.add("position");
      break;
    }
    case "revision":
      if (session && change.points.length > 0) {
        revise(session.trail, change.points);
        session.revised_from_ns = Math.min(session.revised_from_ns, change.points[0][0]);
      }
      changed.add("trail");
      break;
    case "session": {
      if (change.deleted) {
        state.sessions.delete(change.deleted);
        changed.add("session");
        break;
      }
      const row = change.session;
      const known = state.sessions.get(row.id);
      // The row counts its visits and anomalies; the live lists and the trail are this page's own.
      const { trail: _t, visits: _v, stands: _s, anomalies: _a, position: _p, ...facts } = row;
      state.sessions.set(row.id, known ? Object.assign(known, facts) : liveSession(facts));
      changed.add("session");
      break;
    }
    case "inspectors":
      state.inspectors = new Map(change.inspectors.map((/** @type {Inspector} */ i) => [i.id, i]));
      changed.add("session");
      break;
    case "visit":
      // Told once when it is keyed in, and again when it has been weighed.
      if (session) keep(session.visits, change, (known) => known.id === change.id);
      changed.add("visit");
      break;
    case "visit_removed":
      if (session) session.visits = session.visits.filter((known) => known.id !== change.id);
      changed.add("visit");
      break;
    case "stands":
      if (session) {
        const told = new Set(change.stands.map((/** @type {Stand} */ stand) => stand.number));
        const others = change.all ? [] : session.stands.filter((known) => !told.has(known.number));
        session.stands = [...others, ...change.stands].sort((a, b) => a.number - b.number).slice(-KEPT);
      }
      changed.add("stand");
      break;
    case "anomaly":
      if (session) keep(session.anomalies, change, () => false);
      changed.add("anomaly");
      break;
    case "fault":
      state.faults.set(change.fault.id, change.fault);
      changed.add("fault");
      break;
    case "alarm_raised":
      state.alarms.set(change.alarm.key, change.alarm);
      changed.add("fault");
      break;
    case "alarm_ended":
      state.alarms.delete(change.key);
      changed.add("fault");
      break;
    case "alarm":
      state.acknowledged.set(change.acknowledged.key, change.acknowledged);
      changed.add("fault");
      break;
    case "markers":
      state.markers_revision = change.revision;
      changed.add("markers");
      break;
    case "job":
      state.jobs.set(change.job.id, change.job);
      changed.add("job");
      break;
  }
}

/**
 * A position of a session that was not told yet: it begins here.
 * @param {LiveState} state
 * @param {Position} position
 */
function newcomer(state, position) {
  const session = liveSession({
    id: position.session_id,
    inspector_id: position.inspector_id,
    state: "live",
    started_at: null,
  });
  state.sessions.set(session.id, session);
  return session;
}

/**
 * @template T
 * @param {T[]} list
 * @param {T} item
 * @param {(known: T) => boolean} same what it takes the place of
 */
function keep(list, item, same) {
  const at = list.findIndex(same);
  if (at >= 0) list[at] = item;
  else list.push(item);
  if (list.length > KEPT) list.shift();
}
