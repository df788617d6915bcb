// Bearer tokens of devices and scripts: made here, shown once, taken back here.

import * as api from "../api.js";
import { dateTime } from "../format.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { inspectorsOf } from "../state/live.js";
import { problemBox } from "../ui/problem.js";
import { onSubmit, text } from "./view.js";

/** What a token can be for, the commonest first. */
const RIGHTS = ["read", "walk", "walk_for_others", "dispatch", "survey", "engineer", "administer"];

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} box
 * @param {boolean} all everybody's, which only shows and revokes
 */
export function showTokens(app, box, all) {
  const rights = RIGHTS.filter((right) => app.me.rights.includes(right));
  render(
    box,
    html`<h2>${t(all ? "tokens.all" : "tokens.own")}</h2>
      <div class="list" data-testid="tokens"></div>
      ${
        !all &&
        html`<form data-draft class="new-token">
          <h3>${t("tokens.new")}</h3>
          <div class="three">
            <label class="field"
              ><span>${t("tokens.name")}</span><input name="name" autocomplete="off" required
            /></label>
            <label class="field"
              ><span>${t("tokens.inspector")}</span
              ><select name="inspector">
                <option value="">${t("tokens.any_inspector")}</option>
                ${inspectorsOf(app.live).map((i) => html`<option value="${i.id}">${i.name}</option>`)}
              </select></label
            >
            <label class="field"><span>${t("tokens.expires")}</span><input name="expires" type="date" /></label>
          </div>
          <fieldset>
            <legend>${t("tokens.rights")}</legend>
            <div class="choices">
              ${rights.map((right) => html`<label><input type="checkbox" name="granted" value="${right}" ${right === "read" ? "checked" : ""} /><span>${t(`right.${right}`)}</span></label>`)}
            </div>
          </fieldset>
          <div class="answer" aria-live="polite"></div>
          <div class="row end"><button>${t("tokens.make")}</button></div>
        </form>`
      }`,
  );
  const list = one(".list", box);
  const form = box.querySelector("form");
  if (form) {
    onSubmit(form, async (data) => {
      const inspector = text(data, "inspector");
      const expires = text(data, "expires");
      const made = await api.makeToken({
        name: text(data, "name"),
        rights: data.getAll("granted"),
        ...(inspector ? { inspector_id: inspector } : {}),
        // The end of that day, site time.
        ...(expires ? { expires_at: new Date(`${expires}T23:59:59+08:00`).toISOString() } : {}),
      });
      /** @type {HTMLFormElement} */ (form).reset();
      render(
        one(".answer", form),
        html`<div class="done" role="status">
          <b>${t("tokens.made")}</b>
          <p class="mono" data-testid="token-secret">${made.secret}</p>
        </div>`,
      );
      show();
    });
  }

  async function show() {
    try {
      const tokens = await api.tokens(all);
      render(
        list,
        tokens.length === 0
          ? html`<p class="muted">${t("tokens.none")}</p>`
          : html`<table>
              <thead>
                <tr>
                  <th>${t("tokens.name")}</th>
                  <th>${t("tokens.rights")}</th>
                  <th>${t("tokens.used")}</th>
                  <th>${t("tokens.expires")}</th>
                  <th><span class="unseen">${t("tokens.revoke")}</span></th>
                </tr>
              </thead>
              <tbody>
                ${tokens.map(
                  (token) =>
                    html`<tr>
                      <td>${token.name}</td>
                      <td>
                        ${token.rights.map((right) => t(`right.${right}`)).join(", ")}${token.inspector_id && html` · ${app.live.inspectors.get(token.inspector_id)?.name ?? ""}`}
                      </td>
                      <td>${dateTime(token.used_at)}</td>
                      <td>${dateTime(token.expires_at)}</td>
                      <td class="num">
                        ${token.revoked_at ? html`<span class="muted">${t("tokens.revoked")}</span>` : html`<button type="button" data-revoke="${token.id}">${t("tokens.revoke")}</button>`}
                      </td>
                    </tr>`,
                )}
              </tbody>
            </table>`,
      );
    } catch (error) {
      render(list, problemBox(error));
    }
  }

  list.addEventListener("click", async (event) => {
    const id = /** @type {HTMLElement} */ (event.target).dataset.revoke;
    if (!id) return;
    await api.revokeToken(id);
    show();
  });
  show();
}
