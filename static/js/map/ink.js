// The map's colours, from the same custom properties as everything else. Canvas knows no CSS variables,
// so they are read once for each theme.

/** @typedef {Record<"ground" | "plan" | "planStrong" | "road" | "dot" | "dotLabel" | "text" | "muted" | "halo" | "accent" | "low" | "medium" | "high" | "bad" | "warn" | "runA" | "runB" | "arrow", string> & {people: string[], font: string}} Ink */

/** @type {Ink | null} */
let ink = null;

/** After a change of theme. */
export function forgetInk() {
  ink = null;
}

/** @returns {Ink} */
export function inkOf() {
  if (ink) return ink;
  const style = getComputedStyle(document.documentElement);
  const read = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
  ink = {
    ground: read("--map-ground"),
    plan: read("--map-plan"),
    planStrong: read("--map-plan-strong"),
    road: read("--map-road"),
    dot: read("--map-dot"),
    dotLabel: read("--map-dot-label"),
    text: read("--text"),
    muted: read("--muted"),
    halo: read("--map-halo"),
    accent: read("--accent"),
    low: read("--low"),
    medium: read("--medium"),
    high: read("--high"),
    bad: read("--bad"),
    warn: read("--warn"),
    runA: read("--run-main"),
    runB: read("--run-without"),
    arrow: read("--run-arrow"),
    people: [1, 2, 3, 4, 5, 6, 7, 8].map((i) => read(`--person-${i}`)),
    font: read("--font"),
  };
  return ink;
}

/**
 * The colour of a name: one of the above, or a number for the colours of people.
 * @param {string} name
 * @returns {string}
 */
export function inkNamed(name) {
  const all = inkOf();
  const colour = all.people[Number(name)] ?? /** @type {Record<string, unknown>} */ (all)[name];
  return typeof colour === "string" ? colour : all.text;
}

/**
 * A person's colour: always the same for the same person. The name stands beside it; colour only helps.
 * @param {string} id
 * @param {number} count of colours
 */
export function colourIndex(id, count) {
  let hash = 0;
  for (const c of id) hash = (hash * 31 + (c.codePointAt(0) ?? 0)) >>> 0;
  return hash % count;
}
