// Keys for those who watch all day. Never while somebody types, never with Ctrl or Alt.

/**
 * @param {import("../app.js").App} app
 * @param {{help: {show(): void}, goTo: {show(): void}}} dialogs
 */
export function makeKeyboard(app, { help, goTo }) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    const target = /** @type {HTMLElement} */ (event.target);
    const typing = target.closest("input, textarea, select") !== null;
    if (document.querySelector("dialog[open]")) return;
    if (event.key === "Escape") {
      if (typing) leave(target);
      else if (app.ui.goal) app.ui.goal = null;
      else app.select(null);
      app.layers.repaint();
      app.changed("choice");
      return;
    }
    if (typing) return;
    const run = actions[event.key.toLowerCase()];
    if (!run) return;
    event.preventDefault();
    run();
  });

  /**
   * Some browsers empty a search field by themselves on Escape, without a word to those who listen: here it is
   * always emptied, and told.
   *
   * @param {HTMLElement} field
   */
  function leave(field) {
    if (field instanceof HTMLInputElement && field.type === "search" && field.value !== "") {
      field.value = "";
      field.dispatchEvent(new Event("input", { bubbles: true }));
    }
    field.blur();
  }

  const click = (/** @type {string} */ id) => /** @type {HTMLElement | null} */ (document.querySelector(id))?.click();

  /** @type {Record<string, () => void>} */
  const actions = {
    "?": () => help.show(),
    g: () => goTo.show(),
    f: () => click("#toggle-follow"),
    e: () => click("#toggle-ellipses"),
    t: () => click("#toggle-trails"),
    "/": () => /** @type {HTMLElement | null} */ (document.querySelector("#side input[type=search]"))?.focus(),
    n: () => {
      // The next of those who need attention, in the list's order.
      const needy = app.people().filter((p) => p.rank < 5);
      if (needy.length === 0) return;
      const at = needy.findIndex((p) => p.inspector.id === app.ui.selected);
      app.select(needy[(at + 1) % needy.length].inspector.id);
    },
  };
}
