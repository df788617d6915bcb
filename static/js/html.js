// Markup from templates. What is filled in is escaped by the tag, never trusted; the page is touched
// only where the outcome differs from what it shows.

/** Markup that has been through the tag. */
class Markup {
  /** @param {string} text */
  constructor(text) {
    this.text = text;
  }
}

/** @type {Record<string, string>} */
const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };

/**
 * @param {unknown} value
 * @returns {string}
 */
function fill(value) {
  if (value === null || value === undefined || value === false) return "";
  if (value instanceof Markup) return value.text;
  if (Array.isArray(value)) return value.map(fill).join("");
  return String(value).replace(/[&<>"']/g, (c) => ESCAPES[c]);
}

/**
 * @param {TemplateStringsArray} strings
 * @param {unknown[]} values
 * @returns {{text: string}}
 */
export function html(strings, ...values) {
  return new Markup(strings.reduce((text, part, i) => text + fill(values[i - 1]) + part));
}

/** @type {WeakMap<Element, string>} */
const shown = new WeakMap();

/**
 * Shows markup in an element, unless it is there already.
 * @param {Element} el
 * @param {{text: string}} markup
 * @returns {boolean} whether the page changed
 */
export function render(el, markup) {
  if (shown.get(el) === markup.text) return false;
  shown.set(el, markup.text);
  el.innerHTML = markup.text;
  return true;
}

/**
 * @param {Element} el
 * @param {string} text
 */
export function setText(el, text) {
  if (el.textContent !== text) el.textContent = text;
}

/**
 * @param {Element} el
 * @param {string} name
 * @param {string | null} value null takes the attribute away
 */
export function setAttribute(el, name, value) {
  if (el.getAttribute(name) === value) return;
  if (value === null) el.removeAttribute(name);
  else el.setAttribute(name, value);
}

/**
 * An element that must be there.
 * @param {string} selector
 * @param {ParentNode} [root]
 * @returns {HTMLElement}
 */
export function one(selector, root = document) {
  const el = root.querySelector(selector);
  if (!(el instanceof HTMLElement)) throw new Error(`no element ${selector}`);
  return el;
}
