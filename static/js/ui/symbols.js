// Signs that mean the same in the list, in the legend and on the map: the shape carries the meaning.

import { html } from "../html.js";

/** @type {Record<string, {text: string}>} */
const GLYPHS = {
  walking: html`<path class="fill" d="M5 3 L15 9 L5 15 Z" />`,
  standing: html`<rect class="fill" x="4.5" y="4.5" width="9" height="9" />`,
  silent: html`<circle cx="9" cy="9" r="6" stroke-dasharray="3 2.4" /><path d="M6.2 9 H11.8" />`,
  lost: html`<path d="M4 4 L14 14 M14 4 L4 14" stroke-width="2.6" />`,
  starting: html`<circle cx="9" cy="9" r="5" stroke-dasharray="2 2" />`,
  off: html`<path d="M5 9 H13" />`,
};

/** @param {string} presence */
export function presencePath(presence) {
  return GLYPHS[presence] ?? GLYPHS.off;
}

/** @param {string} presence */
export function presenceGlyph(presence) {
  return html`<svg class="glyph" data-presence="${presence}" viewBox="0 0 18 18" aria-hidden="true">
    ${presencePath(presence)}
  </svg>`;
}

/** @type {Record<string, {text: string}>} */
const SHAPES = {
  low: html`<circle cx="8" cy="8" r="5.5" />`,
  medium: html`<path d="M8 1.5 L15 14 H1 Z" />`,
  high: html`<path d="M8 0.5 L15.5 8 L8 15.5 L0.5 8 Z" />`,
};

/** @param {string} severity */
export function severitySymbol(severity) {
  return html`<svg class="fault-sign" data-severity="${severity}" viewBox="0 0 16 16" aria-hidden="true">
    ${SHAPES[severity] ?? SHAPES.low}
  </svg>`;
}
