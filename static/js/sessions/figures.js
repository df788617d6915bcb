// A figure with what it is, as the cards of a walk show it.

import { html } from "../html.js";
import { t } from "../i18n.js";

/**
 * @param {string} value
 * @param {string} key of the words below it
 * @param {"" | "good" | "warn" | "bad"} [tone]
 */
export const figure = (value, key, tone = "") =>
  html`<div><b class="${tone}">${value}</b><small>${t(key)}</small></div>`;
