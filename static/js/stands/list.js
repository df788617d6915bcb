// Where an inspector stood: the likely markers as bars, one of them to be accepted, and taken back. The
// same on the live screen and in a session.

import * as api from "../api.js";
import { elapsed, length, percent } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { standChoices, visitOfStand } from "../state/findings.js";

/** @typedef {import("../state/findings.js").Stand} Stand */
/** @typedef {import("../state/findings.js").Visit} Visit */

/**
 * @param {Stand[]} stands
 * @param {Visit[]} visits of the same walk
 * @param {boolean} writes whether they may be accepted and taken back
 */
export function standCards(stands, visits, writes) {
  return html`${stands.map((stand) => {
    const visit = visitOfStand(stand, visits);
    const keyed = visit !== null && (visit.origin ?? "keyed") === "keyed";
    const { named, none } = standChoices(stand);
    return html`<div class="stand" data-testid="stand" data-stand="${stand.number}">
      <p class="line">
        <b class="grow">${elapsed(stand.t_start_ns / 1e9)}${visit && html` · ${visit.marker}`}</b>
        ${visit && html`<span class="tag good">${t(`stand.origin.${visit.origin ?? "keyed"}`)}</span>`}
        ${stand.lasts && html`<span class="tag">${t("stand.lasts")}</span>`}
        ${visit && !keyed && writes && html`<button type="button" data-take-back="${stand.number}">${t("stand.take_back")}</button>`}
      </p>
      ${named.map((candidate) => html`<div class="candidate"><button type="button" data-choose="${candidate.marker}" data-of="${stand.number}" aria-label="${t("stand.accept", { marker: candidate.marker ?? "" })}" ${(!writes || keyed || visit?.marker === candidate.marker) && "disabled"}>${candidate.marker}</button>${bar(candidate.probability)}<span class="num d">${length(candidate.distance_m)}</span></div>`)}
      <div class="candidate"><span class="muted">${t("fault.none_of_these")}</span>${bar(none)}<span></span></div>
    </div>`;
  })}`;
}

/** @param {number} probability */
function bar(probability) {
  return html`<progress max="1" value="${probability.toFixed(3)}" aria-hidden="true"></progress
    ><span class="num p">${percent(probability)}</span>`;
}

/**
 * What a click on a stand asks for; null when it is about something else.
 * @param {HTMLElement} target
 * @param {string} sessionId
 * @returns {Promise<unknown> | null}
 */
export function standClicked(target, sessionId) {
  const choose = target.closest("[data-choose]");
  if (choose)
    return api.chooseMarker(
      sessionId,
      Number(choose.getAttribute("data-of")),
      choose.getAttribute("data-choose") ?? "",
    );
  const takeBack = target.closest("[data-take-back]");
  if (takeBack) return api.takeChoiceBack(sessionId, Number(takeBack.getAttribute("data-take-back")));
  return null;
}
