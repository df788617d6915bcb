// Where a file of markers comes from: what a session has surveyed is called by the session, and leads to it.

import { html } from "../html.js";
import { t } from "../i18n.js";

/**
 * A link to the session whose survey a file is; null for any other.
 * @param {string | null | undefined} fileName
 */
export function sourceOf(fileName) {
  const id = /^survey-([0-9a-f-]{36})\.csv$/.exec(fileName ?? "")?.[1];
  return id ? html`<a href="#/sessions/${id}" data-testid="survey-source">${t("markers.by_survey")}</a>` : null;
}
