// One's own account: who one is here, password, browsers, tokens; and the first account of all.

import * as api from "../api.js";
import { dateTime } from "../format.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { whoIsChanging } from "./door.js";
import { showTokens } from "./tokens.js";

/** @type {import("../ui/router.js").MakeView} */
export function accountView(app, side) {
  if (app.me.has_accounts) showOwn(app, side);
  else showSetUp(side);
  return {};
}

/** @param {HTMLElement} side */
function showSetUp(side) {
  render(
    side,
    html`<div class="page">
      <h1 data-t="account.set_up"></h1>
      <p class="lead" data-t="account.set_up_lead"></p>
      <form class="block" data-testid="set-up">
        <label class="field"
          ><span data-t="account.setup_token"></span
          ><input name="setup_token" autocomplete="off" spellcheck="false" required
        /></label>
        <div class="two">
          <label class="field"
            ><span data-t="account.name"></span><input name="name" autocomplete="username" required
          /></label>
          <label class="field"
            ><span data-t="account.new_password"></span
            ><input name="password" type="password" autocomplete="new-password" minlength="10" required
          /></label>
        </div>
        <div class="answer" aria-live="polite"></div>
        <div class="row end"><button class="main-action" data-t="account.set_up_go"></button></div>
      </form>
      <div class="row"><a href="#/admin" data-t="nav.admin"></a> <a href="#/api" data-t="nav.api"></a></div>
    </div>`,
  );
  translate(side);
  onSubmit(one("form", side), async (data) => {
    await whoIsChanging(() =>
      api.setUp({
        setup_token: text(data, "setup_token"),
        name: text(data, "name"),
        password: String(data.get("password")),
      }),
    );
    location.reload();
  });
}

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} side
 */
function showOwn(app, side) {
  const { me } = app;
  render(
    side,
    html`<div class="page">
      <h1>${me.name ?? t("nav.account")}</h1>
      <p class="lead">
        ${me.role ? t(`role.${me.role}`) : ""} · ${me.rights.map((right) => t(`right.${right}`)).join(" · ")}
      </p>
      <div class="row">
        <button type="button" class="sign-out" data-t="account.sign_out"></button>
        ${me.rights.includes("administer") && html`<a href="#/admin" data-t="nav.admin"></a>`}
        <a href="#/api" data-t="nav.api"></a>
      </div>
      <form class="block password" data-testid="password">
        <h2 data-t="account.change_password"></h2>
        <input
          class="unseen"
          name="name"
          autocomplete="username"
          value="${me.name ?? ""}"
          tabindex="-1"
          aria-hidden="true"
        />
        <div class="two">
          <label class="field"
            ><span data-t="account.old_password"></span
            ><input name="old" type="password" autocomplete="current-password" required
          /></label>
          <label class="field"
            ><span data-t="account.new_password"></span
            ><input name="new" type="password" autocomplete="new-password" minlength="10" required
          /></label>
        </div>
        <div class="answer" aria-live="polite"></div>
        <div class="row end"><button data-t="account.change_password"></button></div>
      </form>
      <div class="block browsers">
        <h2 data-t="account.browsers"></h2>
        <div class="list"></div>
      </div>
      <div class="block tokens"></div>
    </div>`,
  );
  translate(side);
  one(".sign-out", side).addEventListener("click", async () => {
    await api.signOut();
    location.reload();
  });
  onSubmit(one("form.password", side), async (data, form) => {
    await api.changePassword({ old: String(data.get("old")), new: String(data.get("new")) });
    /** @type {HTMLFormElement} */ (form).reset();
    render(one(".answer", form), html`<p class="done" role="status">${t("account.password_changed")}</p>`);
    showBrowsers(one(".browsers .list", side));
  });
  showBrowsers(one(".browsers .list", side));
  showTokens(app, one(".tokens", side), false);
}

/** @param {HTMLElement} box */
async function showBrowsers(box) {
  try {
    const list = await api.signIns();
    render(
      box,
      html`<table>
        <thead>
          <tr>
            <th>${t("account.browser")}</th>
            <th>${t("account.address")}</th>
            <th>${t("account.seen")}</th>
            <th><span class="unseen">${t("account.sign_out")}</span></th>
          </tr>
        </thead>
        <tbody>
          ${list.map(
            (s) =>
              html`<tr>
                <td>${browserName(s.agent)}</td>
                <td>${s.address}</td>
                <td>${dateTime(s.seen_at)}</td>
                <td class="num"><button type="button" data-end="${s.id}">${t("account.sign_out")}</button></td>
              </tr>`,
          )}
        </tbody>
      </table>`,
    );
  } catch (error) {
    render(box, problemBox(error));
  }
  box.onclick = async (event) => {
    const id = /** @type {HTMLElement} */ (event.target).dataset.end;
    if (!id) return;
    await api.endSignIn(id);
    showBrowsers(box);
  };
}

/** @param {string} agent what a browser calls itself, of which only the family says something */
function browserName(agent) {
  const family = ["Edg", "Firefox", "Chrome", "Safari"].find((name) => agent.includes(name));
  const system = ["Windows", "Android", "iPhone", "iPad", "Mac OS", "Linux"].find((name) => agent.includes(name));
  return [family === "Edg" ? "Edge" : family, system].filter(Boolean).join(", ") || agent.slice(0, 40) || "–";
}

/**
 * @param {HTMLElement} form
 * @param {(data: FormData, form: HTMLElement) => Promise<void>} run
 */
export function onSubmit(form, run) {
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const answer = one(".answer", form);
    const button = /** @type {HTMLButtonElement} */ (one("button:not([type=button])", form));
    render(answer, html``);
    button.disabled = true;
    try {
      await run(new FormData(/** @type {HTMLFormElement} */ (form)), form);
    } catch (error) {
      render(answer, problemBox(error));
    }
    button.disabled = false;
  });
}

/**
 * @param {FormData} data
 * @param {string} name
 */
export const text = (data, name) => String(data.get(name) ?? "").trim();
