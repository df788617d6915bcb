// The parts of a walk's side panel, one at a time.

import { html, render } from "../html.js";
import { t } from "../i18n.js";

/**
 * @param {HTMLElement} el where the tabs stand
 * @param {HTMLElement} root holds the panels, `data-panel` each
 * @param {string[]} names
 */
export function makeTabs(el, root, names) {
  render(
    el,
    html`${names.map((name) => html`<button type="button" role="tab" id="tab-${name}" aria-controls="panel-${name}" data-tab="${name}">${t(`session.tab.${name}`)}</button>`)}`,
  );
  el.setAttribute("role", "tablist");
  for (const panel of panels()) {
    panel.id = `panel-${panel.dataset.panel}`;
    panel.setAttribute("role", "tabpanel");
    panel.setAttribute("aria-labelledby", `tab-${panel.dataset.panel}`);
  }
  show(names[0]);
  el.addEventListener("click", (event) => {
    const name = /** @type {HTMLElement} */ (event.target).closest("[data-tab]")?.getAttribute("data-tab");
    if (name) show(name);
  });
  el.addEventListener("keydown", (event) => {
    const by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    const at = names.indexOf(/** @type {HTMLElement} */ (event.target).getAttribute("data-tab") ?? "");
    if (by === 0 || event.altKey || at < 0) return;
    const next = names[(at + by + names.length) % names.length];
    show(next);
    /** @type {HTMLElement | null} */ (el.querySelector(`[data-tab=${next}]`))?.focus();
  });

  function panels() {
    return /** @type {NodeListOf<HTMLElement>} */ (root.querySelectorAll("[data-panel]"));
  }

  /** @param {string} name */
  function show(name) {
    for (const tab of el.querySelectorAll("[data-tab]")) {
      const chosen = tab.getAttribute("data-tab") === name;
      tab.setAttribute("aria-selected", String(chosen));
      tab.setAttribute("tabindex", chosen ? "0" : "-1");
    }
    for (const panel of panels()) panel.hidden = panel.dataset.panel !== name;
  }
}
