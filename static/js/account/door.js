// The door: where there are accounts, nobody gets in without signing in.

import * as api from "../api.js";
import { html, one, render, setText } from "../html.js";
import { currentLanguage, loadLanguage, t, translate } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { remember } from "../ui/remembered.js";

/**
 * Who is in front of the page, asked until it is somebody.
 * @param {Promise<void>} words what the door needs to say anything
 * @returns {Promise<api.Me>}
 */
export async function throughTheDoor(words) {
  const me = await api.account();
  if (me.known) return me;
  await words;
  document.documentElement.dataset.ready = "door";
  await signInHere();
  document.documentElement.dataset.ready = "";
  return api.account();
}

/** While the first account is made, its maker is nobody for a moment: no reason to start afresh, and to lose the answer. */
let changing = false;

/**
 * @template T
 * @param {() => Promise<T>} change
 * @returns {Promise<T>}
 */
export async function whoIsChanging(change) {
  changing = true;
  try {
    return await change();
  } finally {
    changing = false;
  }
}

/** A new sign-in is asked for by starting afresh: what the page shows may belong to somebody else. */
export function watchForTheEnd() {
  let told = false;
  addEventListener("signed-out", () => {
    if (told || changing) return;
    told = true;
    location.reload();
  });
}

/** @returns {Promise<void>} */
function signInHere() {
  return new Promise((done) => {
    const dialog = document.createElement("dialog");
    dialog.dataset.testid = "door";
    dialog.setAttribute("aria-labelledby", "door-title");
    one("#dialogs").append(dialog);
    // There is nothing behind it to go back to.
    dialog.addEventListener("cancel", (event) => event.preventDefault());
    render(
      dialog,
      html`<form class="door">
        <h1 id="door-title" data-t="door.title"></h1>
        <label class="field"
          ><span data-t="account.name"></span
          ><input name="name" autocomplete="username" autocapitalize="none" spellcheck="false" required autofocus
        /></label>
        <label class="field"
          ><span data-t="account.password"></span
          ><input name="password" type="password" autocomplete="current-password" required
        /></label>
        <div class="answer" aria-live="polite"></div>
        <div class="row end"><button class="main-action" data-t="door.sign_in"></button></div>
        <p class="muted" data-t="door.lost"></p>
        <div class="row end"><button type="button" class="quiet" data-language></button></div>
      </form>`,
    );
    const form = /** @type {HTMLFormElement} */ (one("form", dialog));
    const language = one("[data-language]", form);
    const other = () => (currentLanguage() === "en" ? "zh-CN" : "en");
    const named = () => {
      setText(language, other() === "en" ? "English" : "中文");
      language.lang = other();
    };
    named();
    language.addEventListener("click", async () => {
      remember("language", other());
      await loadLanguage(other());
      translate(form);
      named();
    });
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const data = new FormData(form);
      const button = /** @type {HTMLButtonElement} */ (one("button", form));
      button.disabled = true;
      try {
        await api.signIn({ name: String(data.get("name")), password: String(data.get("password")) });
        dialog.close();
        dialog.remove();
        done();
      } catch (error) {
        render(one(".answer", form), problemBox(error));
        /** @type {HTMLInputElement} */ (one("[name=password]", form)).select();
      }
      button.disabled = false;
    });
    translate(form);
    dialog.showModal();
  });
}
