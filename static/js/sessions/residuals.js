// How far off a walk was at its markers, before each corrected it: the figures and the distribution, as
// papers print them.

import { length, number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { offBefore } from "../state/findings.js";
import { figure } from "./figures.js";

/** The neighbouring actuators stand this far apart: a walk that is farther off ties a fault to a wrong one, m. */
export const REQUIRED_M = 11;

/**
 * @typedef {{count: number, mean_m: number, rms_m: number, largest_m: number, within_95_m: number, bins: number[], bin_m: number}} Residuals
 *   `within_95_m`: 95 of 100 are smaller; `bins`: how many lie in each `bin_m`, from 0 on
 */

/**
 * @param {import("../state/findings.js").Visit[]} visits
 * @returns {Residuals | null} of the visits that were used; null where there are none
 */
export function residualsOf(visits) {
  const offs = visits
    .filter((v) => v.accepted)
    .map((v) => offBefore(v))
    .filter((m) => m !== null)
    .sort((a, b) => a - b);
  if (offs.length === 0) return null;
  const largest_m = offs[offs.length - 1];
  const bin_m = [0.25, 0.5, 1, 2, 5].find((width) => largest_m / width <= 14) ?? 10;
  const bins = new Array(Math.floor(largest_m / bin_m) + 1).fill(0);
  for (const off of offs) bins[Math.floor(off / bin_m)] += 1;
  return {
    count: offs.length,
    mean_m: offs.reduce((a, b) => a + b, 0) / offs.length,
    rms_m: Math.sqrt(offs.reduce((a, b) => a + b * b, 0) / offs.length),
    largest_m,
    within_95_m: offs[Math.ceil(0.95 * offs.length) - 1],
    bins,
    bin_m,
  };
}

/** Of fewer visits than this 95 of 100 is no figure: it would be the largest. */
const ENOUGH_FOR_95 = 20;

/** @param {Residuals | null} found */
export function residualCard(found) {
  if (!found)
    return html`<h2>${t("sessions.residuals.title")}</h2>
      <p class="muted">${t("sessions.residuals.none")}</p>`;
  const passed = found.largest_m < REQUIRED_M;
  return html`<h2>${t("sessions.residuals.title")}</h2>
    <div class="figures" data-testid="residuals">
      ${figure(String(found.count), "sessions.residuals.count")}
      ${figure(length(found.mean_m), "sessions.residuals.mean")}
      ${figure(length(found.rms_m), "sessions.residuals.rms")}
      ${found.count >= ENOUGH_FOR_95 && figure(length(found.within_95_m), "sessions.residuals.within_95")}
      ${figure(length(found.largest_m), "sessions.residuals.largest")}
      ${figure(t(passed ? "sessions.residuals.passed" : "sessions.residuals.failed"), "sessions.residuals.required", passed ? "good" : "bad")}
    </div>
    ${histogram(found)}`;
}

const WIDTH = 420;
const HEIGHT = 130;
const LEFT = 26;
const BOTTOM = 30;

/** @param {Residuals} found */
function histogram({ bins, bin_m, count }) {
  const most = Math.max(...bins);
  const step = (WIDTH - LEFT) / bins.length;
  const y = (/** @type {number} */ n) => HEIGHT - BOTTOM - (n / most) * (HEIGHT - BOTTOM - 14);
  const said = bins.map((n, i) => `${number(i * bin_m, 2)}–${number((i + 1) * bin_m, 2)} m: ${n}`).join("; ");
  return html`<svg
    class="histogram"
    viewBox="0 0 ${String(WIDTH)} ${String(HEIGHT)}"
    role="img"
    aria-label="${t("sessions.residuals.histogram", { count })}: ${said}"
    data-testid="histogram"
  >
    <line class="axis" x1="${String(LEFT)}" y1="${String(y(0))}" x2="${String(WIDTH)}" y2="${String(y(0))}" />
    ${bins.map(
      (n, i) =>
        html`<rect
            x="${(LEFT + i * step + 1).toFixed(1)}"
            y="${y(n).toFixed(1)}"
            width="${(step - 2).toFixed(1)}"
            height="${(y(0) - y(n)).toFixed(1)}"
          />
          ${n > 0 && html`<text x="${(LEFT + (i + 0.5) * step).toFixed(1)}" y="${(y(n) - 3).toFixed(1)}">${String(n)}</text>`}
          <text class="edge" x="${(LEFT + i * step).toFixed(1)}" y="${String(HEIGHT - BOTTOM + 13)}"
            >${String(i * bin_m)}</text
          >`,
    )}
    <text class="edge" x="${String((LEFT + WIDTH) / 2)}" y="${String(HEIGHT - 3)}">
      ${t("sessions.residuals.axis")}
    </text>
  </svg>`;
}
