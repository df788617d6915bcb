// The address of a moment: which walk, when, which runs of it, and which other walks beside it.

/** @typedef {{t_s: number | null, runs: string[] | null, beside: string[]}} Moment `null` where the address says nothing */

/**
 * @param {string} hash
 * @returns {Moment}
 */
export function readMoment(hash) {
  const query = new URLSearchParams(hash.split("?")[1] ?? "");
  const list = (/** @type {string} */ name) => query.get(name)?.split(" ").join("+").split(",").filter(Boolean);
  const t_s = Number.parseFloat(query.get("t") ?? "");
  return { t_s: Number.isFinite(t_s) ? t_s : null, runs: list("run") ?? null, beside: list("with") ?? [] };
}

/**
 * @param {string} id of the walk
 * @param {{t_s: number, runs: string[], beside: string[]}} moment
 */
export function writeMoment(id, { t_s, runs, beside }) {
  const parts = [`t=${Number(t_s.toFixed(2))}`, `run=${runs.join(",")}`];
  if (beside.length > 0) parts.push(`with=${beside.map(encodeURIComponent).join(",")}`);
  return `#/sessions/${encodeURIComponent(id)}?${parts.join("&")}`;
}
