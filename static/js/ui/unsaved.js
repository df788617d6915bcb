// Edits that were not saved: the page asks before it leaves them.

import { t } from "../i18n.js";

/** Forms with edits: those marked as drafts alone. A search loses nothing. @type {Set<HTMLFormElement>} */
const edited = new Set();

const draftOf = (/** @type {Event} */ event) =>
  /** @type {Element} */ (event.target).closest?.("form[data-draft]") ?? null;

/** Follows every draft of the page. */
export function watchDrafts() {
  document.addEventListener("input", (event) => {
    const form = draftOf(event);
    if (form instanceof HTMLFormElement) edited.add(form);
  });
  for (const name of ["submit", "reset"])
    document.addEventListener(name, (event) => edited.delete(/** @type {HTMLFormElement} */ (event.target)), true);
}

/** Whether there are edits that would be lost. */
export function unsaved() {
  for (const form of edited) if (!form.isConnected) edited.delete(form);
  return edited.size > 0;
}

/**
 * Whether the screen may be left.
 * @param {boolean} others whether the screen itself has something that would be lost
 */
export function mayLeave(others) {
  if (!unsaved() && !others) return true;
  const leaves = confirm(t("unsaved.leave"));
  if (leaves) edited.clear();
  return leaves;
}
