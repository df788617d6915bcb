// The inspector's own walk as this device knows it: who, which walk, what was keyed in. Runs without a browser.

/**
 * @typedef {{e_m: number, n_m: number, name: string}} Place
 * @typedef {{id: string, marker: string, at_ms: number, session_id: string, t_start_ns: number, visit_id: string | null, undone: boolean}} Keyed
 *   `id` is the outbox's; `visit_id` the server's, once it has the visit
 * @typedef {{walk: {id: string, started_ms: number, live: boolean} | null, ended: {id: string} | null, keyed: Keyed[]}} Own
 * @typedef {Own & {inspector_id: string, others: Record<string, Own>}} Mine
 *   who is at this device now, and the walks of the others who share it, by inspector
 */

/** How long a visit can be taken back, ms. */
export const UNDO_MS = 30_000;
/** An inspector who keys in a number has stood there for about this long, s. */
const STOOD_S = 4;
/** Entries that are kept to be shown. */
const KEPT = 20;
/** Nobody hurries faster under the reflector, m/s … */
const FASTEST_M_S = 2.5;
/** … and this much is left to the positions, m. */
const SLACK_M = 40;

const KEY = "me";

/** @param {{recall: (key: string) => string | null}} storage @returns {Mine} */
export function recallMine(storage) {
  const empty = { inspector_id: "", walk: null, ended: null, keyed: [], others: {} };
  try {
    const found = JSON.parse(storage.recall(KEY) ?? "null");
    return found && typeof found.inspector_id === "string" && Array.isArray(found.keyed)
      ? { ...empty, ...found }
      : empty;
  } catch {
    return empty;
  }
}

/**
 * @param {{remember: (key: string, value: string | null) => void}} storage
 * @param {Mine} mine
 */
export function rememberMine(storage, mine) {
  storage.remember(KEY, JSON.stringify({ ...mine, keyed: mine.keyed.slice(-KEPT) }));
}

/**
 * Somebody else steps up to the device. The walk under way is kept.
 * @param {Mine} mine
 * @param {string} inspector_id
 */
export function changePerson(mine, inspector_id) {
  const { walk, ended, keyed } = mine;
  if (mine.inspector_id && walk) mine.others[mine.inspector_id] = { walk, ended, keyed: keyed.slice(-KEPT) };
  const own = mine.others[inspector_id] ?? { walk: null, ended: null, keyed: [] };
  delete mine.others[inspector_id];
  Object.assign(mine, { inspector_id, ...own });
}

/**
 * When somebody stands at a marker who keys it in now: the stand that lasts, where the track knows of one.
 * @param {number} started_ms
 * @param {number} now_ms
 * @param {{lasts: boolean, t_start_ns: number}[]} stands
 */
export function visitTimes(started_ms, now_ms, stands) {
  const t_end_s = Math.max(0, (now_ms - started_ms) / 1000);
  const stand = stands.find((s) => s.lasts);
  const t_start_s = stand ? Math.min(stand.t_start_ns / 1e9, t_end_s) : Math.max(0, t_end_s - STOOD_S);
  return { t_start_s: round(t_start_s), t_end_s: round(t_end_s) };
}

/** Milliseconds are finer than any thumb, and come back from the server as they went. @param {number} s */
const round = (s) => Math.round(s * 1000) / 1000;

/**
 * Why somebody can hardly be at this marker; null when nothing speaks against it.
 * @param {Place} place
 * @param {{position: {position_m: number[], sigma_m: number[]} | null, last: {place: Place, ago_s: number} | null}} known
 * @returns {{key: "position" | "hurry", metres: number} | null}
 */
export function doubt(place, { position, last }) {
  if (position) {
    const [e, n] = position.position_m;
    const metres = Math.hypot(place.e_m - e, place.n_m - n);
    const sigma = Math.hypot(position.sigma_m[0], position.sigma_m[1]);
    return metres > Math.max(15, 4 * sigma) ? { key: "position", metres } : null;
  }
  if (last && last.place.name !== place.name) {
    const metres = Math.hypot(place.e_m - last.place.e_m, place.n_m - last.place.n_m);
    if (metres > SLACK_M + FASTEST_M_S * last.ago_s) return { key: "hurry", metres };
  }
  return null;
}

/**
 * The markers to offer, likeliest or nearest first.
 * @param {{candidates: {marker: string | null, probability: number, distance_m: number | null}[]} | undefined} stand that lasts
 * @param {number[] | null} near east and north to look around, m
 * @param {(e_m: number, n_m: number, n: number) => {place: Place, distance_m: number}[]} nearest
 * @returns {{marker: string, distance_m: number | null, probability: number | null}[]}
 */
export function chips(stand, near, nearest) {
  const named = (stand?.candidates ?? []).filter((c) => c.marker !== null);
  if (named.length > 0)
    return named
      .slice(0, 6)
      .map((c) => ({ marker: c.marker ?? "", distance_m: c.distance_m, probability: c.probability }));
  if (!near) return [];
  return nearest(near[0], near[1], 6).map(({ place, distance_m }) => ({
    marker: place.name,
    distance_m,
    probability: null,
  }));
}

/** The letters that the names of markers begin with: keys of the pad. @param {Iterable<string>} names */
export function firstLetters(names) {
  const letters = new Set();
  for (const name of names) if (/^\p{L}/u.test(name)) letters.add(name[0].toUpperCase());
  return [...letters].sort().slice(0, 8);
}

/**
 * What a key does to what is typed.
 * @param {string} typed
 * @param {string} key
 */
export function press(typed, key) {
  if (key === "back") return typed.slice(0, -1);
  if (key === "clear") return "";
  // A letter begins a name: another one begins it anew.
  if (/^\p{L}$/u.test(key)) return /^\p{L}/u.test(typed) ? key + typed.slice(1) : key + typed;
  return (typed + key).slice(0, 12);
}
