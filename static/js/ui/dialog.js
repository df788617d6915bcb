// A dialog in the page. The browser keeps the focus inside, closes it on Escape and gives the focus back.

import { one, render } from "../html.js";

/**
 * @param {string} name for tests and styles
 * @returns {{el: HTMLDialogElement, open: (markup: {text: string}) => void, close: () => void}}
 */
export function makeDialog(name) {
  const el = document.createElement("dialog");
  el.dataset.testid = `dialog-${name}`;
  el.setAttribute("aria-labelledby", `${name}-title`);
  one("#dialogs").append(el);
  el.addEventListener("click", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    // A click on the backdrop has the dialog itself as its target.
    if (target === el || target.closest("[data-close]")) el.close();
  });
  // Who goes back in the browser leaves what the dialog stood over.
  addEventListener("hashchange", () => el.close());
  return {
    el,
    open(markup) {
      render(el, markup);
      if (!el.open) el.showModal();
    },
    close: () => el.close(),
  };
}
