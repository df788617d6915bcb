// Everybody's accounts: added, given another role, kept out.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { onSubmit, text } from "../account/view.js";
import { inspectorsOf } from "../state/live.js";
import { problemBox } from "../ui/problem.js";
import { makeAttempt } from "./attempt.js";

const ROLES = ["viewer", "inspector", "dispatcher", "surveyor", "engineer", "admin"];

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} box
 */
export function showAccounts(app, box) {
  if (!app.me.has_accounts) {
    render(box, html`<p>${t("admin.no_accounts")} <a href="#/account">${t("account.set_up")}</a></p>`);
    return;
  }
  const inspectors = () => inspectorsOf(app.live);
  render(
    box,
    html`<h2>${t("admin.accounts")}</h2>
      <div class="answer" aria-live="polite"></div>
      <div class="list"></div>
      <form data-draft>
        <h3>${t("admin.new_account")}</h3>
        <div class="two">
          <label class="field"
            ><span>${t("account.name")}</span><input name="name" autocomplete="off" required
          /></label>
          <label class="field"
            ><span>${t("account.new_password")}</span
            ><input name="password" type="password" autocomplete="new-password" minlength="10" required
          /></label>
          <label class="field"
            ><span>${t("admin.role")}</span
            ><select name="role">
              ${ROLES.map((role) => html`<option value="${role}">${t(`role.${role}`)}</option>`)}
            </select></label
          >
          <label class="field"
            ><span>${t("admin.inspector")}</span
            ><select name="inspector">
              <option value="">–</option>
              ${inspectors().map((i) => html`<option value="${i.id}">${i.name}</option>`)}
            </select></label
          >
        </div>
        <div class="answer" aria-live="polite"></div>
        <div class="row end"><button>${t("admin.add")}</button></div>
      </form>`,
  );
  const list = one(".list", box);
  const answer = one(".answer", box);

  async function show() {
    try {
      const accounts = await api.accounts();
      render(
        list,
        html`<table data-testid="accounts">
          <thead>
            <tr>
              <th>${t("account.name")}</th>
              <th>${t("admin.role")}</th>
              <th>${t("admin.inspector")}</th>
              <th>${t("admin.may_sign_in")}</th>
              <th><span class="unseen">${t("admin.change")}</span></th>
            </tr>
          </thead>
          <tbody>
            ${accounts.map(
              (a) =>
                html`<tr data-account="${a.id}">
                  <td>${a.name}</td>
                  <td>
                    <select data-field="role" aria-label="${t("admin.role")} ${a.name}">
                      ${ROLES.map((role) => html`<option value="${role}" ${role === a.role ? "selected" : ""}>${t(`role.${role}`)}</option>`)}
                    </select>
                  </td>
                  <td>
                    <select data-field="inspector_id" aria-label="${t("admin.inspector")} ${a.name}">
                      <option value="">–</option>
                      ${inspectors().map((i) => html`<option value="${i.id}" ${i.id === a.inspector_id ? "selected" : ""}>${i.name}</option>`)}
                    </select>
                  </td>
                  <td>
                    <input
                      type="checkbox"
                      data-field="disabled"
                      aria-label="${t("admin.may_sign_in")} ${a.name}"
                      ${a.disabled ? "" : "checked"}
                    />
                  </td>
                  <td class="num"><button type="button" data-remove>${t("admin.remove")}</button></td>
                </tr>`,
            )}
          </tbody>
        </table>`,
      );
    } catch (error) {
      render(list, problemBox(error));
    }
  }

  // What was picked and refused is taken back.
  const attempt = makeAttempt(answer, show, () => render(list, html``));

  list.addEventListener("change", (event) => {
    const field = /** @type {HTMLInputElement} */ (event.target);
    const id = /** @type {HTMLElement} */ (field.closest("[data-account]")).dataset.account ?? "";
    const name = field.dataset.field ?? "";
    const value = name === "disabled" ? !field.checked : field.value || null;
    attempt(() => api.changeAccount(id, { [name]: value }));
  });
  list.addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target);
    if (!("remove" in button.dataset)) return;
    const row = /** @type {HTMLTableRowElement} */ (button.closest("[data-account]"));
    if (!confirm(t("admin.remove_sure", { name: row.cells[0].textContent ?? "" }))) return;
    attempt(() => api.removeAccount(row.dataset.account ?? ""));
  });
  onSubmit(one("form", box), async (data, form) => {
    const inspector = text(data, "inspector");
    await api.addAccount({
      name: text(data, "name"),
      password: String(data.get("password")),
      role: text(data, "role"),
      ...(inspector ? { inspector_id: inspector } : {}),
    });
    /** @type {HTMLFormElement} */ (form).reset();
    show();
  });
  show();
}
