// Walks of the mock that are looked for, as docs/wire.md says.

/**
 * @param {any[]} walks
 * @param {any[]} inspectors
 * @param {URLSearchParams} query
 */
export function searchSessions(walks, inspectors, query) {
  const asked = (/** @type {string} */ name) => query.get(name) ?? "";
  const all = walks.map((walk) => ({
    title: "",
    starred: false,
    note: "",
    noted_by: null,
    noted_at: null,
    closure_m: 2.1,
    closure_is_large: false,
    rejected_visits: 0,
    gaps: 0,
    from_log: walk.state !== "live",
    ...walk,
    anomalies: walk.anomalies ?? 0,
    stored_bytes: (walk.samples ?? 0) * 40,
    inspector: inspectors.find((i) => i.id === walk.inspector_id)?.name ?? "",
  }));
  /** @type {Record<string, (walk: any) => boolean>} */
  const flags = {
    closure: (w) => w.closure_is_large,
    rejected: (w) => w.rejected_visits > 0,
    anomalies: (w) => w.anomalies > 0,
    gap: (w) => w.gaps > 0,
    starred: (w) => w.starred,
    noted: (w) => w.note !== "",
  };
  /** @type {Record<string, (walk: any) => number | string>} */
  const keys = {
    started: (w) => Date.parse(w.started_at),
    distance: (w) => w.distance_m,
    duration: (w) => w.duration_s,
    closure: (w) => w.closure_m,
    stored: (w) => w.stored_bytes,
    inspector: (w) => w.inspector,
  };
  const found = all.filter(
    (w) =>
      `${w.title} ${w.note} ${w.inspector}`.toLowerCase().includes(asked("text").toLowerCase()) &&
      (!asked("inspector_id") || w.inspector_id === asked("inspector_id")) &&
      (!asked("state") || w.state === asked("state")) &&
      (!asked("from") || Date.parse(w.started_at) >= Date.parse(asked("from"))) &&
      (!asked("to") || Date.parse(w.started_at) < Date.parse(asked("to"))) &&
      (!asked("mode") || { log: w.from_log, stream: !w.from_log, automatic: w.automatic_visits }[asked("mode")]) &&
      asked("flags")
        .split(",")
        .filter(Boolean)
        .every((flag) => flags[flag](w)),
  );
  const key = keys[asked("sort") || "started"];
  found.sort((a, b) => (key(a) < key(b) ? -1 : key(a) > key(b) ? 1 : 0));
  if (asked("ascending") !== "true") found.reverse();
  const offset = Number(asked("offset"));
  return {
    total: found.length,
    stored_bytes: found.reduce((sum, w) => sum + w.stored_bytes, 0),
    sessions: found.slice(offset, offset + Number(asked("limit") || 50)),
  };
}
