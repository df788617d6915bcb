// Is the log sound? Asked before anybody looks at a chart: its rate, gaps, readings at their limit, and whether
// it began at rest.

import { number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { keyOf } from "../systems/index.js";
import { times } from "./anomalies.js";
import { figure } from "./figures.js";

/** @typedef {import("../systems/index.js").System} System */
/** @typedef {{rate_hz: Record<string, number | null>, gaps: number, lost_s: number, saturated: number, still: boolean, other: number}} Health */

/** Kinds of trouble that have a figure of their own. */
const COUNTED = ["gap", "saturation", "no_still_start"];

/**
 * @param {System} system
 * @param {{chart: string, series: string, low: (number | null)[]}[]} rates how many samples each second had, a line a stream
 * @param {import("../state/findings.js").Anomaly[]} anomalies
 * @returns {Health}
 */
export function healthOf({ uploadSlots }, rates, anomalies) {
  const of = (/** @type {string} */ kind) => anomalies.filter((a) => a.anomaly === kind);
  const gaps = of("gap");
  return {
    rate_hz: Object.fromEntries(
      uploadSlots.map(({ stream }) => {
        // The middle one of all seconds: a gap does not change the sensor's rate.
        const found =
          rates
            .find((line) => line.series === stream)
            ?.low.filter((n) => n !== null)
            .sort((a, b) => a - b) ?? [];
        return [stream, found.length > 0 ? found[found.length >> 1] : null];
      }),
    ),
    gaps: gaps.reduce((sum, gap) => sum + times(gap), 0),
    // Of many that are told as one it is not known how long each was.
    lost_s: gaps.reduce((sum, gap) => sum + (times(gap) > 1 ? 0 : (gap.t_end_ns - gap.t_start_ns) / 1e9), 0),
    saturated: of("saturation").reduce((sum, a) => sum + a.samples, 0),
    still: of("no_still_start").length === 0,
    other: anomalies.filter((a) => !COUNTED.includes(a.anomaly)).reduce((sum, a) => sum + times(a), 0),
  };
}

/**
 * @param {System} system
 * @param {Health} health
 */
export function healthCard(system, { rate_hz, gaps, lost_s, saturated, still, other }) {
  const rates = Object.values(rate_hz).map((rate) => (rate === null ? "–" : number(rate, 0)));
  return html`<h2>${t("sessions.health.title")}</h2>
    <div class="figures" data-testid="health">
      ${figure(`${rates.join(" / ") || "–"} Hz`, keyOf(system, "sessions.health.rate"))}
      ${figure(gaps === 0 ? "0" : `${gaps} · ${number(lost_s, 1)} s`, "sessions.health.gaps", gaps === 0 ? "good" : "warn")}
      ${figure(String(saturated), "sessions.health.saturated", saturated === 0 ? "good" : "warn")}
      ${figure(t(still ? "sessions.health.still" : "sessions.health.not_still"), "sessions.health.start", still ? "good" : "bad")}
      ${figure(String(other), "sessions.health.other", other === 0 ? "good" : "warn")}
    </div>`;
}
