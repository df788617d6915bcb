// What has changed on the cabin: which devices correct the pose, what says where the platform is, and how far the filter is.

/** What says where the platform is, by the number in the chart `source`. */
export const SOURCES = ["none", "encoders", "own_sensor", "held"];

/**
 * @typedef {import("./cabin_drawing.js").Past} Past
 * @typedef {{t_s: number, gone: string[], back: string[], state: number | null, source: number | null}} Change
 */

/**
 * The changes from moment to moment, the newest first. What goes or comes within two seconds is one change: devices of a kind go at
 * their own rows.
 * @param {Past[]} past
 * @param {string[]} names
 * @param {number} most
 * @returns {Change[]}
 */
export function changesOf(past, names, most) {
  /** @type {Change[]} */
  const changes = [];
  for (let i = 1; i < past.length; i++) {
    const [before, now] = [past[i - 1], past[i]];
    // A hole says nothing of when.
    const gone = names.filter((_, k) => before.aids[k] && !now.aids[k]);
    const back = names.filter((_, k) => !before.aids[k] && now.aids[k]);
    const state = now.state === before.state ? null : now.state;
    const source = now.source === before.source ? null : now.source;
    if (gone.length + back.length === 0 && state === null && source === null) continue;
    const last = changes.at(-1);
    const joins = last && now.t_s - last.t_s <= 2 && !gone.some((name) => last.back.includes(name));
    if (last && joins && !back.some((name) => last.gone.includes(name))) {
      last.gone.push(...gone);
      last.back.push(...back);
      last.state = state ?? last.state;
      last.source = source ?? last.source;
    } else changes.push({ t_s: now.t_s, gone, back, state, source });
  }
  return changes.toReversed().slice(0, most);
}

/**
 * Names that are numbered one after the other, as one: `A1–A6, S2`.
 * @param {string[]} names
 */
export function together(names) {
  /** @type {{head: string, from: number, to: number}[]} */
  const runs = [];
  /** @type {string[]} */
  const others = [];
  for (const name of names.toSorted((a, b) => a.localeCompare(b, "en", { numeric: true }))) {
    const [, head, digits] = /^(.*?)(\d+)$/.exec(name) ?? [];
    const last = runs.at(-1);
    if (head === undefined) others.push(name);
    else if (last?.head === head && last.to + 1 === Number(digits)) last.to += 1;
    else runs.push({ head, from: Number(digits), to: Number(digits) });
  }
  const words = runs.map(({ head, from, to }) =>
    from === to ? `${head}${from}` : `${head}${from}${to === from + 1 ? ", " : "–"}${head}${to}`,
  );
  return [...words, ...others].join(", ");
}
