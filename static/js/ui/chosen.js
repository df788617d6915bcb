// Who and what is selected stands in the address: what one sees can be sent to a colleague.

/** The screens on which somebody or something is selected. */
const SCREENS = ["live", "faults"];

/** @typedef {{selected: string | null, fault: string | null, at_ms: number | null}} Chosen `at_ms`: a moment that is past; null: now */

/**
 * @param {{ui: Chosen}} app
 * @param {string} hash what it does not name stays
 */
export function readChosen({ ui }, hash) {
  const query = new URLSearchParams(hash.split("?")[1] ?? "");
  const [screen] = hash.replace(/^#\/?/, "").split("?");
  const at_ms = Date.parse(query.get("at") ?? "");
  ui.at_ms = (screen || "live") === "live" && Number.isFinite(at_ms) ? at_ms : null;
  if (!SCREENS.includes(screen || "live")) return;
  ui.selected = query.get("person") ?? ui.selected;
  ui.fault = query.get("fault") ?? ui.fault;
}

/**
 * @param {{ui: Chosen}} app
 * @param {string} screen
 * @returns {string | null} the address; null for a screen that keeps its own
 */
export function chosenAddress({ ui }, screen) {
  if (!SCREENS.includes(screen)) return null;
  const query = new URLSearchParams();
  if (ui.selected) query.set("person", ui.selected);
  if (ui.fault) query.set("fault", ui.fault);
  if (ui.at_ms !== null && screen === "live") query.set("at", `${new Date(ui.at_ms).toISOString().slice(0, 19)}Z`);
  return `#/${screen}${query.size > 0 ? `?${query}` : ""}`;
}
