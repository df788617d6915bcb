// What staff say of a walk: a mark, and a short text.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} box
 * @param {string} id
 */
export async function showNote(app, box, id) {
  const said = await api.sessionNote(id).catch(() => null);
  if (!said || !box.isConnected) return;
  if (!app.may("walk_for_others")) {
    render(
      box,
      html`${(said.starred || said.note) && html`<p data-testid="note">${said.starred && "★ "}${said.note}</p>`}`,
    );
    return;
  }
  render(
    box,
    html`<form data-draft class="row" data-testid="note">
        <button
          type="button"
          class="star"
          aria-pressed="${String(said.starred)}"
          aria-label="${t("sessions.star")}"
          title="${t("sessions.star")}"
        >
          ${said.starred ? "★" : "☆"}
        </button>
        <input
          name="note"
          class="grow"
          maxlength="500"
          value="${said.note}"
          placeholder="${t("sessions.note")}"
          aria-label="${t("sessions.note")}"
        /><button>${t("sessions.keep")}</button>
      </form>
      <div class="answer" aria-live="polite"></div>`,
  );
  const form = one("form", box);
  const text = () => /** @type {HTMLInputElement} */ (one("[name=note]", box)).value;
  const save = async (/** @type {boolean} */ starred) => {
    try {
      await api.setSessionNote(id, { starred, note: text() });
      await showNote(app, box, id);
    } catch (error) {
      render(one(".answer", box), problemBox(error));
    }
  };
  one(".star", form).addEventListener("click", () => save(!said.starred));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    save(said.starred);
  });
}
