// Who needs attention. The page ages people itself: a server that has gone silent must not leave
// somebody shown as walking.

import { stands } from "../faults/states.js";
import { worstSigma } from "../geometry.js";
import { GONE_AFTER_S, LOST_AFTER_S } from "./live.js";

/**
 * @typedef {import("./live.js").LiveState} LiveState
 * @typedef {import("./live.js").LiveSession} LiveSession
 * @typedef {"gone" | "lost" | "silent" | "walking" | "standing" | "starting" | "off"} Presence
 * @typedef {{
 *   inspector: import("./live.js").Inspector, session: LiveSession | null, position: import("./live.js").Position | null, presence: Presence, age_s: number | null,
 *   sigma_m: number | null, poor: boolean, overdue: boolean, faults: number, rank: number,
 * }} Person
 */

/** Made once: comparing by locale makes one for every pair of names. */
const byName = new Intl.Collator(undefined, { numeric: true });

/** No word for this long: silent. Two to three feed intervals and some network. */
export const SILENT_AFTER_S = 5;
/** How fast somebody may walk of whom nothing is heard, m/s: as the server has it. */
const WALKING_M_S = 1.4;
/** One sigma beyond which the nearest actuator is a guess: they stand about 10 m apart. */
export const POOR_SIGMA_M = 5;
/** The working rule is a marker about every 150 m or 2 min; twice that is overdue. */
export const OVERDUE_M = 300;
export const OVERDUE_S = 300;

/**
 * @param {LiveState} state
 * @param {number} now_ms this machine's clock
 */
export function serverNow(state, now_ms) {
  return now_ms + state.server_offset_ms;
}

/**
 * @param {LiveSession | null} session
 * @param {number} server_now_ms
 * @param {{lost_after_s: number, gone_after_s: number}} limits as the server was set up
 * @returns {{presence: Presence, age_s: number | null}}
 */
export function presenceOf(
  session,
  server_now_ms,
  limits = { lost_after_s: LOST_AFTER_S, gone_after_s: GONE_AFTER_S },
) {
  if (session?.state !== "live") return { presence: "off", age_s: null };
  if (!session.position) return { presence: "starting", age_s: null };
  const age_s = Math.max(0, (server_now_ms - Date.parse(session.position.received_at)) / 1000);
  if (age_s > limits.gone_after_s) return { presence: "gone", age_s };
  if (age_s > limits.lost_after_s) return { presence: "lost", age_s };
  if (age_s > SILENT_AFTER_S || session.position.state === "silent") return { presence: "silent", age_s };
  return { presence: session.position.state === "standing" ? "standing" : "walking", age_s };
}

/**
 * A position of which nothing was heard for so long: as unsure as a walk in any direction makes it.
 * @param {import("./live.js").Position} position
 * @param {number | null} age_s
 * @returns {import("./live.js").Position}
 */
export function aged(position, age_s) {
  if (age_s === null || age_s <= SILENT_AFTER_S) return position;
  const [e, n, u] = position.sigma_m;
  const walked_m = WALKING_M_S * age_s;
  return {
    ...position,
    sigma_m: [Math.hypot(e, walked_m), Math.hypot(n, walked_m), u],
    since_marker_s: (position.since_marker_s ?? 0) + age_s,
  };
}

/**
 * Everybody, those who need attention first. The order goes by coarse classes, then by name: a list
 * that reorders with every metre cannot be read.
 * @param {LiveState} state
 * @param {number} now_ms
 * @returns {Person[]}
 */
export function people(state, now_ms) {
  const server_now_ms = serverNow(state, now_ms);
  /** @type {Map<string, LiveSession>} */
  const latest = new Map();
  for (const session of state.sessions.values()) {
    if (session.state !== "live") continue;
    const other = latest.get(session.inspector_id);
    if (!other || (session.started_at ?? "") >= (other.started_at ?? "")) latest.set(session.inspector_id, session);
  }
  /** @type {Map<string, number>} */
  const openFaults = new Map();
  for (const fault of state.faults.values()) {
    if (stands(fault) && fault.inspector_id) {
      openFaults.set(fault.inspector_id, (openFaults.get(fault.inspector_id) ?? 0) + 1);
    }
  }
  const ids = new Set([...state.inspectors.keys(), ...latest.keys()]);
  const list = [...ids].map((id) => {
    const session = latest.get(id) ?? null;
    const { presence, age_s } = presenceOf(session, server_now_ms, state);
    const position = session?.position ? aged(session.position, age_s) : null;
    const sigma_m = position ? worstSigma(position.sigma_m, position.covariance_en_m2) : null;
    const poor = sigma_m !== null && sigma_m > POOR_SIGMA_M;
    const overdue =
      position !== null && ((position.since_marker_m ?? 0) > OVERDUE_M || (position.since_marker_s ?? 0) > OVERDUE_S);
    const inspector = state.inspectors.get(id) ?? { id, name: id.slice(0, 8) };
    const person = {
      inspector,
      session,
      position,
      presence,
      age_s,
      sigma_m,
      poor,
      overdue,
      faults: openFaults.get(id) ?? 0,
      rank: 0,
    };
    person.rank = rank(person);
    return person;
  });
  return list.sort((a, b) => a.rank - b.rank || byName.compare(a.inspector.name, b.inspector.name));
}

/** @param {Omit<Person, "rank">} person */
function rank(person) {
  if (person.presence === "off") return 9;
  if (person.presence === "gone") return 8;
  if (person.presence === "lost") return 0;
  if (person.presence === "silent") return 1;
  if (person.poor) return 2;
  if (person.overdue) return 3;
  return 5;
}
