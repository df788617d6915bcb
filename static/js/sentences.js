// What the server found, in the page's language: a sentence with figures is made here of its code and its figures.

import { number } from "./format.js";
import { html } from "./html.js";
import { has, t } from "./i18n.js";
import { keyOf } from "./systems/index.js";

/** @typedef {Record<string, number | string>} Figures by name, the unit at its end */

/**
 * A figure with as many decimals as mean something at its size.
 * @param {number | string} figure
 */
export function figure(figure) {
  if (typeof figure === "string") return figure;
  const size = Math.abs(figure);
  const digits = size >= 100 ? 1 : size >= 10 ? 2 : size >= 1 ? 3 : 4;
  return number(Number(figure.toFixed(digits)), Math.min(digits, decimals(Number(figure.toFixed(digits)))));
}

/** @param {number} value */
const decimals = (value) => (String(value).split(".")[1] ?? "").length;

/**
 * The sentence of the figures, the system's own where it has one; the server's own, which is English, where this page has none for them, as of what was
 * stored before figures were kept. What has no figures is said by the general sentence of its kind.
 * @param {import("./systems/index.js").System | null} system null: of none
 * @param {string} start what it is about, as messages name it
 * @param {{detail: string, figures?: Figures | null}} found
 */
export function sentence(system, start, { detail, figures }) {
  if (!figures) return html`<span lang="en">${detail}</span>`;
  const names = Object.keys(figures).sort();
  if (names.length === 0) return "";
  const key = keyOf(system, [start, ...names].join("."));
  if (!has(key)) return html`<span lang="en">${detail}</span>`;
  return t(key, Object.fromEntries(names.map((name) => [name, figure(figures[name])])));
}
