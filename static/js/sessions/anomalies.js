// What was wrong with the sensors of a walk, in the words of its system.

import { elapsed } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { aboutAnomaly, streamOf, word } from "../systems/index.js";
import { sentence } from "../sentences.js";

/** How many of its kind are told by this one. @param {import("../state/findings.js").Anomaly} a */
export const times = (a) => a.times ?? 1;

/** @param {import("../state/findings.js").Anomaly} a */
function many(a) {
  if (times(a) === 1) return null;
  return html`<small>${t("session.times", { n: times(a), until: elapsed(a.t_end_ns / 1e9) })}</small>`;
}

/**
 * @param {import("../systems/index.js").System} system
 * @param {import("../state/findings.js").Anomaly[]} anomalies
 */
export function anomalyTable(system, anomalies) {
  return html`<h2>${t("session.anomalies")}</h2>
    ${
      anomalies.length === 0
        ? html`<p class="muted">${t("session.no_anomalies")}</p>`
        : html`<div class="scroll" tabindex="0" role="region" aria-label="${t("session.anomalies")}">
            <table data-testid="anomalies">
              <thead>
                <tr>
                  <th>${t("session.time")}</th>
                  <th>${t("session.what")}</th>
                  <th>${word(system, "session.stream")}</th>
                  <th>${t("session.found")}</th>
                </tr>
              </thead>
              <tbody>
                ${anomalies.map(
                  (a) =>
                    html`<tr>
                      <td>
                        <button type="button" data-at="${String(a.t_start_ns / 1e9)}">
                          ${elapsed(a.t_start_ns / 1e9)}
                        </button>
                      </td>
                      <td>${word(system, `anomaly.${a.anomaly}`)}</td>
                      <td>${streamOf(system, a) ?? "–"}</td>
                      <td>
                        ${aboutAnomaly(system, a.anomaly)} ${many(a)}
                        <small class="muted">${sentence(system, `anomaly.told.${a.anomaly}`, a)}</small>
                      </td>
                    </tr>`,
                )}
              </tbody>
            </table>
          </div>`
    }`;
}
