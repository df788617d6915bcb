// What walks are looked for by, as it stands in the address and as the server is asked.

/**
 * @typedef {{text: string, inspector_id: string, state: string, from: string, to: string, mode: string, flags: string[], sort: string, page: number}} Wanted
 *   days are site time; a sort with a minus before it begins with the smallest; pages count from 0
 * @typedef {{
 *   id: string, inspector_id: string, inspector: string, title: string, state: string, started_at: string, distance_m: number, duration_s: number, epochs: number,
 *   from_log: boolean, rejected_visits: number, anomalies: number, gaps: number, closure_m: number | null, closure_is_large: boolean,
 *   stored_bytes: number, starred: boolean, note: string, noted_by: string | null, noted_at: string | null,
 * }} Found
 * @typedef {{total: number, stored_bytes: number, sessions: Found[]}} Page
 */

/** Walks on a page. */
export const PAGE = 50;
export const MODES = ["log", "stream", "automatic"];
export const FLAGS = ["closure", "rejected", "anomalies", "gap", "starred", "noted"];
export const SORTS = ["started", "distance", "duration", "closure", "stored", "inspector"];
/** How the site's clock stands to UTC. */
const ZONE = "+08:00";

/**
 * @param {string} hash
 * @returns {Wanted}
 */
export function readSearch(hash) {
  const query = new URLSearchParams(hash.split("?")[1] ?? "");
  const word = (/** @type {string} */ name, /** @type {string[]} */ known) => {
    const found = query.get(name) ?? "";
    return known.includes(found) ? found : "";
  };
  const day = (/** @type {string} */ name) =>
    /^\d{4}-\d\d-\d\d$/.test(query.get(name) ?? "") ? String(query.get(name)) : "";
  return {
    text: query.get("text") ?? "",
    inspector_id: query.get("inspector_id") ?? "",
    state: query.get("state") ?? "",
    from: day("from"),
    to: day("to"),
    mode: word("mode", MODES),
    flags: (query.get("flags") ?? "").split(",").filter((flag) => FLAGS.includes(flag)),
    sort: word("sort", [...SORTS, ...SORTS.map((sort) => `-${sort}`)]) || SORTS[0],
    page: Math.max(0, Math.floor(Number(query.get("page") ?? 1)) - 1 || 0),
  };
}

/** @param {Wanted} wanted */
export function writeSearch(wanted) {
  const parts = [];
  for (const [name, value] of Object.entries(wanted)) {
    const text =
      name === "page"
        ? wanted.page > 0
          ? String(wanted.page + 1)
          : ""
        : name === "sort" && value === SORTS[0]
          ? ""
          : String(value);
    if (text) parts.push(`${name}=${encodeURIComponent(text).replaceAll("%2C", ",")}`);
  }
  return `#/sessions${parts.length > 0 ? `?${parts.join("&")}` : ""}`;
}

/**
 * As the server is asked: a day begins and ends by the site's clock, and the last one counts.
 * @param {Wanted} wanted
 */
export function toQuery(wanted) {
  const query = new URLSearchParams({ limit: String(PAGE), offset: String(wanted.page * PAGE) });
  for (const name of /** @type {const} */ (["text", "inspector_id", "state", "mode"]))
    if (wanted[name].trim()) query.set(name, wanted[name].trim());
  if (wanted.from) query.set("from", `${wanted.from}T00:00:00${ZONE}`);
  if (wanted.to) query.set("to", new Date(Date.parse(`${wanted.to}T00:00:00${ZONE}`) + 86_400_000).toISOString());
  if (wanted.flags.length > 0) query.set("flags", wanted.flags.join(","));
  query.set("sort", wanted.sort.replace("-", ""));
  if (wanted.sort.startsWith("-")) query.set("ascending", "true");
  return query;
}
