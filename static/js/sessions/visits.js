// The visits of a walk: how far off the track was at each marker, and what became of it.

import { elapsed, length, number } from "../format.js";
import { html, render } from "../html.js";
import { t } from "../i18n.js";
import { offBefore, visitOutcome, visitTime } from "../state/findings.js";
import { keyOf } from "../systems/index.js";

/** @type {Record<string, string>} */
const TONES = { accepted: "good", rejected: "bad", waiting: "" };

/**
 * @param {HTMLElement} el
 * @param {import("../state/findings.js").Visit[]} visits
 * @param {boolean} writes whether they may be taken back
 * @param {import("../systems/index.js").System} system one that places itself is held against its visits, not corrected by them
 */
export function showVisits(el, visits, writes, system) {
  const held = system.placesItself;
  const digits = held ? 3 : 1;
  render(
    el,
    html`<h2>${t("session.visits")}</h2>
      ${
        visits.length === 0
          ? html`<p class="muted">${t("session.no_visits")}</p>`
          : html`<div class="scroll" tabindex="0" role="region" aria-label="${t("session.visits")}">
              <table data-testid="visits">
                <thead>
                  <tr>
                    <th>${t("session.time")}</th>
                    <th>${t("session.marker")}</th>
                    <th>${t("session.outcome")}</th>
                    <th class="num">${t(keyOf(system, "session.before"))}</th>
                    <th class="num">ΔE</th>
                    <th class="num">ΔN</th>
                    <th class="num">NIS</th>
                    ${writes && html`<td></td>`}
                  </tr>
                </thead>
                <tbody>
                  ${visits.map((v) => {
                    const off = v.before_minus_marker_m;
                    const outcome = visitOutcome(v);
                    return html`<tr>
                        <td>${elapsed(visitTime(v))}</td>
                        <td>${markerButton(v)}</td>
                        <td>
                          <span class="tag ${!held && TONES[outcome]}">${t(keyOf(system, `visit.${outcome}`))}</span>
                        </td>
                        <td class="num">${held ? number(offBefore(v), digits) : length(offBefore(v))}</td>
                        <td class="num">${number(off?.[0], digits)}</td>
                        <td class="num">${number(off?.[1], digits)}</td>
                        <td class="num">${number(v.nis, 1)}</td>
                        ${writes && html`<td><button type="button" class="quiet" data-remove-visit="${v.id}" aria-label="${t("session.take_back", { marker: v.marker })}" title="${t("session.take_back", { marker: v.marker })}">✕</button></td>`}
                      </tr>
                      ${
                        v.reason &&
                        html`<tr class="reason">
                          <td></td>
                          <td colspan="6"><small class="muted">${v.reason}</small></td>
                        </tr>`
                      }`;
                  })}
                </tbody>
              </table>
            </div>`
      }`,
  );
}

/** Leads to the visit, on the map and in time. @param {import("../state/findings.js").Visit} v */
const markerButton = (v) =>
  html`<button type="button" data-visit="${v.marker}" data-at="${String(visitTime(v))}">${v.marker}</button>`;
