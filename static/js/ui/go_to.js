// Go to an actuator by its name.

import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { makeDialog } from "./dialog.js";

const MOST_HITS = 8;

/** @param {import("../app.js").App} app */
export function makeGoTo(app) {
  const dialog = makeDialog("go");

  /** @param {string} text */
  function hits(text) {
    const wanted = text.trim().toUpperCase();
    if (wanted === "") return [];
    const exact = app.grid.named(wanted);
    const begins = app.places.filter((node) => node.name.toUpperCase().startsWith(wanted) && node !== exact);
    return [...(exact ? [exact] : []), ...begins].slice(0, MOST_HITS);
  }

  /** @param {string} name */
  function go(name) {
    const node = app.grid.named(name);
    if (!node) return;
    dialog.close();
    app.ui.goal = node.name;
    app.ui.follow = false;
    if (one("#main").dataset.layout === "page") location.hash = "#/live";
    app.stage.goTo([node.e_m, node.n_m], 3);
    app.layers.repaint();
    app.changed("choice");
  }

  dialog.el.addEventListener("input", () => list());
  dialog.el.addEventListener("submit", (event) => {
    event.preventDefault();
    const first = hits(field().value)[0];
    if (first) go(first.name);
  });
  dialog.el.addEventListener("click", (event) => {
    const name = /** @type {HTMLElement} */ (event.target).closest("[data-name]")?.getAttribute("data-name");
    if (name) go(name);
  });

  const field = () => /** @type {HTMLInputElement} */ (one("input", dialog.el));

  function list() {
    const found = hits(field().value);
    const none = field().value.trim() !== "" && found.length === 0;
    render(
      one(".hits", dialog.el),
      html` ${none && html`<p class="empty">${t("go.none", { name: field().value })}</p>`}
      ${found.map((node) => html`<button type="button" class="card" data-name="${node.name}"><b>${node.name}</b> <span class="muted">E ${node.e_m.toFixed(1)} · N ${node.n_m.toFixed(1)} m</span></button>`)}`,
    );
  }

  return {
    show() {
      dialog.open(
        html` <form>
          <h2 id="go-title">${t("go.title")}</h2>
          <label class="field"
            ><span>${t("go.hint")}</span>
            <input name="name" autocomplete="off" autocapitalize="characters" spellcheck="false" autofocus
          /></label>
          <div class="hits"></div>
          <div class="row end">
            <button type="button" data-close>${t("close")}</button><button class="main-action">${t("go.go")}</button>
          </div>
        </form>`,
      );
      field().value = "";
      list();
      field().focus();
    },
    go,
  };
}
