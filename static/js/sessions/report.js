// How a walk went by what the filter itself saw: each aid with its innovations and their bounds, how well the
// ends meet, how sure the track is.

import { length, number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { keyOf, word } from "../systems/index.js";

/**
 * @typedef {{ aid: string, accepted: number, rejected: number, unusable: number, mean_nis_per_degree: number, bounds_95: [number, number] | null }} AidReport
 * @typedef {{ end_error_m: number, end_error_percent: number, height_error_m: number, path_m: number }} Closure
 * @typedef {{ aids: AidReport[], closure: Closure | null, sigma_plan_m: { rms_m: number, max_m: number } | null, end_sigma_plan_m: number | null, end_sigma_up_m: number | null}} Report what is a system's own is beside
 */

/**
 * What the mean innovation of an aid says of the filter.
 * @param {AidReport} aid
 * @returns {"honest" | "too_sure" | "too_unsure" | "unknown"}
 */
export function verdict(aid) {
  if (!aid.bounds_95 || aid.accepted === 0) return "unknown";
  const [low, high] = aid.bounds_95;
  if (aid.mean_nis_per_degree > high) return "too_sure";
  return aid.mean_nis_per_degree < low ? "too_unsure" : "honest";
}

const TONES = { honest: "good", too_sure: "bad", too_unsure: "", unknown: "" };

/** A walk whose end is farther from its start, in hundredths of the path, was no loop: there is nothing to close. */
const LOOP_PERCENT = 5;

/**
 * @param {import("../systems/index.js").System} system
 * @param {Report} report
 */
export function reportCard(system, report) {
  const { closure } = report;
  const figure = (/** @type {string} */ value, /** @type {string} */ key) =>
    html`<div><b>${value}</b><small>${t(key)}</small></div>`;
  return html`<h2>${t("report.title")}</h2>
    <div class="figures" data-testid="report">
      ${
        closure &&
        closure.end_error_percent <= LOOP_PERCENT &&
        html`${figure(`${length(closure.end_error_m)} · ${number(closure.end_error_percent, 2)} %`, "report.closure")}
        ${figure(length(closure.height_error_m), "report.closure_up")}`
      }
      ${figure(length(report.sigma_plan_m?.rms_m), "report.sigma_rms")}
      ${figure(length(report.sigma_plan_m?.max_m), "report.sigma_largest")}
      ${figure(length(report.end_sigma_up_m), "report.sigma_up")}
      ${system.reportFigures(report).map(({ value, label }) => figure(value, keyOf(system, label)))}
    </div>
    ${
      report.aids.length > 0 &&
      html`<div class="scroll" tabindex="0" role="region" aria-label="${t("report.aid")}">
          <table data-testid="aids">
            <thead>
              <tr>
                <th>${t("report.aid")}</th>
                <th>${t("report.judged")}</th>
                <th class="num">${t("report.accepted")}</th>
                <th class="num">${t("report.rejected")}</th>
                <th class="num">${t("report.unusable")}</th>
                <th class="num">${t("report.innovation")}</th>
                <th class="num">${t("report.bounds")}</th>
              </tr>
            </thead>
            <tbody>
              ${report.aids.map(
                (aid) =>
                  html`<tr>
                    <td>${word(system, `aid.${aid.aid}`)}</td>
                    <td><span class="tag ${TONES[verdict(aid)]}">${t(`report.verdict.${verdict(aid)}`)}</span></td>
                    <td class="num">${String(aid.accepted)}</td>
                    <td class="num">${String(aid.rejected - aid.unusable)}</td>
                    <td class="num">${String(aid.unusable)}</td>
                    <td class="num">${number(aid.mean_nis_per_degree, 2)}</td>
                    <td class="num">
                      ${aid.bounds_95 ? `${number(aid.bounds_95[0], 2)} – ${number(aid.bounds_95[1], 2)}` : "–"}
                    </td>
                  </tr>`,
              )}
            </tbody>
          </table>
        </div>
        <p class="muted">${word(system, "report.hint")}</p>`
    }`;
}
