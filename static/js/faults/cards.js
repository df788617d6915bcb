// Faults as a list. The same card on the live screen and on the faults' own.

import { clock, dateTime, length, percent, siteDay } from "../format.js";
import { html } from "../html.js";
import { t, tOr } from "../i18n.js";
import { severitySymbol } from "../ui/symbols.js";

/** @typedef {import("../state/live.js").Fault} Fault */

const ORDER = { high: 0, medium: 1, low: 2 };

/**
 * Worst first, then newest.
 * @param {Fault[]} faults
 */
export function bySeverity(faults) {
  return [...faults].sort(
    (a, b) => ORDER[a.severity] - ORDER[b.severity] || b.reported_at.localeCompare(a.reported_at),
  );
}

const isToday = (/** @type {string} */ at) => siteDay(Date.parse(at)) === siteDay(Date.now());

/** @param {string} kind */
export const faultKind = (kind) => tOr(`fault.kind.${kind}`, kind);

/**
 * @param {import("../app.js").App} app
 * @param {Fault[]} faults
 */
export function faultCards(app, faults) {
  if (faults.length === 0) return html`<p class="empty">${t("fault.none_open")}</p>`;
  return html`${bySeverity(faults).map((fault) => {
    const goes = fault.assignee_id ? app.live.inspectors.get(fault.assignee_id)?.name : undefined;
    const who = fault.inspector_id ? app.live.inspectors.get(fault.inspector_id)?.name : undefined;
    return html`<button
      type="button"
      class="card"
      data-fault="${fault.id}"
      data-testid="fault-card"
      aria-pressed="${String(fault.id === app.ui.fault)}"
    >
      <span class="line"
        >${severitySymbol(fault.severity)}<b class="grow">${faultKind(fault.kind)}</b
        >${fault.state !== "open" && html`<span class="tag state" data-state="${fault.state}">${t(`fault.state.${fault.state}`)}</span>`}<span
          class="tag"
          >${t(`severity.${fault.severity}`)}</span
        ></span
      >
      <span class="sub"
        ><bdi>${placeOf(fault)}</bdi>${who && html` · <bdi>${who}</bdi>`} ·
        ${isToday(fault.reported_at) ? clock(fault.reported_at) : dateTime(fault.reported_at)}${goes && html` · → <b>${goes}</b>`}${(fault.photos ?? 0) > 0 && html` · ${t("fault.photos_n", { n: fault.photos ?? 0 })}`}</span
      >
    </button>`;
  })}`;
}

/**
 * Where a fault is, and how sure that is: a marker that was keyed in, or the likeliest candidate.
 * @param {Fault} fault
 */
export function placeOf(fault) {
  if (fault.marker) return fault.marker;
  const best = fault.candidates?.find((candidate) => candidate.marker !== null);
  if (!fault.position_m) return t("fault.to_be_placed");
  return best ? `${best.marker} ${percent(best.probability)}` : "–";
}

/**
 * @param {Fault} fault
 * @param {string} who
 */
export function faultDetails(fault, who) {
  return html` <dl class="facts">
      <dt>${t("fault.severity")}</dt>
      <dd>${t(`severity.${fault.severity}`)}</dd>
      <dt>${t("fault.reported")}</dt>
      <dd>${dateTime(fault.reported_at)}</dd>
      <dt>${t("fault.by")}</dt>
      <dd>${who}</dd>
      ${
        fault.marker &&
        html`<dt>${t("fault.keyed")}</dt>
          <dd>${fault.marker}</dd>`
      }
      ${
        fault.position_m &&
        html`<dt>${t("fault.place")}</dt>
          <dd>
            E ${fault.position_m[0].toFixed(1)} · N ${fault.position_m[1].toFixed(1)}
            m${fault.sigma_m && html` ± ${length(Math.hypot(fault.sigma_m[0], fault.sigma_m[1]))}`}
          </dd>`
      }
    </dl>
    ${fault.text && html`<p>${fault.text}</p>`} ${candidateTable(fault)}`;
}

/** @param {Fault} fault */
export function candidateTable(fault) {
  if (!fault.candidates?.length) return html``;
  return html`<table>
    <thead>
      <tr>
        <th>${t("fault.candidate")}</th>
        <th class="num">${t("fault.probability")}</th>
        <th class="num">${t("fault.distance")}</th>
      </tr>
    </thead>
    <tbody>
      ${fault.candidates.map(
        (c) =>
          html`<tr>
            <td>
              ${c.marker === null ? html`<span class="muted">${t("fault.none_of_these")}</span>` : html`<b>${c.marker}</b>`}
            </td>
            <td class="num">${percent(c.probability)}</td>
            <td class="num">${length(c.distance_m)}</td>
          </tr>`,
      )}
    </tbody>
  </table>`;
}
