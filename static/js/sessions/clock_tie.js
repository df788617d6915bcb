// How the clock by which a walk's markers were keyed in stands to that of its logs: what was measured, and a field for
// those who know better.

import { html } from "../html.js";
import { t } from "../i18n.js";

/**
 * @typedef {{state: "same" | "tied" | "ambiguous" | "unmatched" | "too_few" | "given", offset_s: number,
 *   sigma_s: number | null, keyed: number, matched: number}} ClockTie
 */

/** Those that somebody has to look at. */
const ASKED = ["ambiguous", "unmatched"];

/**
 * @param {ClockTie | null | undefined} tie
 * @param {boolean} writes
 */
export function clockCard(tie, writes) {
  if (!tie) return html``;
  const words = t(`sessions.clock_tie.${tie.state}`, {
    offset: signed(tie.offset_s),
    sigma: tie.sigma_s === null ? "–" : tie.sigma_s.toFixed(1),
    matched: tie.matched,
    keyed: tie.keyed,
  });
  return html`<h2>${t("sessions.clock_tie.title")}</h2>
    <p
      data-testid="clock-tie"
      data-state="${tie.state}"
      ${ASKED.includes(tie.state) && html`class="warning" role="alert"`}
    >
      ${words}
    </p>
    ${
      writes &&
      html`<details ${ASKED.includes(tie.state) && "open"}>
        <summary>${t("sessions.clock_tie.correct")}</summary>
        <form data-clock-tie class="row">
          <label class="field"
            ><span>${t("sessions.clock_tie.offset")}</span
            ><input name="offset_s" inputmode="decimal" value="${String(Math.round(tie.offset_s * 10) / 10)}" required
          /></label>
          <button>${t("sessions.clock_tie.apply")}</button>
          ${tie.state === "given" && html`<button type="button" data-measure>${t("sessions.clock_tie.measure")}</button>`}
        </form>
        <p class="muted">${t("sessions.clock_tie.hint")}</p>
      </details>`
    }`;
}

/** @param {number} s */
const signed = (s) => `${s < 0 ? "−" : "+"}${Math.abs(s).toFixed(1)}`;

/**
 * What a submitted form asks for; null where it is no number.
 * @param {HTMLFormElement} form
 */
export function askedOffset(form) {
  const typed = String(new FormData(form).get("offset_s") ?? "").trim();
  const value = Number(typed.replace(",", ".").replace("−", "-"));
  return typed === "" || !Number.isFinite(value) ? null : value;
}
