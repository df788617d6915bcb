// Words in two languages: a message file each, and one each for what a system or a screen alone has to say, whose keys begin
// with its name. A key is the same in both languages.

/** @typedef {Record<string, string>} Messages */

export const LANGUAGES = /** @type {const} */ (["en", "zh-CN"]);

/** @type {Messages} */
let messages = {};
/** @type {string} */
let language = "en";

/**
 * The language to begin with: the one chosen before, else the first of the browser's that we speak.
 * @param {readonly string[]} wanted the browser's languages, best first
 * @param {string | null} chosen
 */
export function pickLanguage(wanted, chosen) {
  if (chosen && LANGUAGES.some((l) => l === chosen)) return chosen;
  for (const tag of wanted) {
    const primary = tag.toLowerCase().split("-")[0];
    if (primary === "zh") return "zh-CN";
    if (primary === "en") return "en";
  }
  return "en";
}

/**
 * @param {string} name
 * @param {Messages} table
 */
export function setLanguage(name, table) {
  language = name;
  messages = table;
}

/** Whose words are loaded along with the language. @type {Set<string>} */
const scopes = new Set();
/** The language that was asked for last. @type {string | null} */
let wanted = null;

/** @param {string} file */
async function fetchWords(file) {
  const response = await fetch(`/messages/${file}.json`);
  if (!response.ok) throw new Error(`messages/${file}.json: HTTP ${response.status}`);
  return response.json();
}

/** @param {string} name */
export async function loadLanguage(name) {
  wanted = name;
  const files = [name, ...[...scopes].map((scope) => `${scope}.${name}`)];
  setLanguage(name, Object.assign({}, ...(await Promise.all(files.map(fetchWords)))));
}

/**
 * The words of a system or a screen, in this language and in each that is chosen from now on.
 * @param {string} scope
 */
export async function addWords(scope) {
  scopes.add(scope);
  if (wanted === null) return;
  const name = wanted;
  const more = await fetchWords(`${scope}.${name}`);
  if (name === wanted) messages = { ...messages, ...more };
}

export const currentLanguage = () => language;

/** Whether there is a message of this key. @param {string} key */
export const has = (key) => Object.hasOwn(messages, key);

/**
 * The message of a key, its {places} filled in; where one thing is counted, that of `key.one` if there is any.
 * @param {string} key
 * @param {Record<string, string | number>} [values]
 */
export function t(key, values) {
  const text = (values?.n === 1 && messages[`${key}.one`]) || (messages[key] ?? key);
  return values ? text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole)) : text;
}

/**
 * The message of a key that may not exist (a kind that the server has and this page does not know).
 * @param {string} key
 * @param {string} otherwise
 */
export function tOr(key, otherwise) {
  return messages[key] ?? otherwise;
}

/**
 * Fills in the fixed words of the page: `data-t` the text, `data-t-label` the accessible name and tooltip,
 * `data-t-hint` the placeholder.
 * @param {ParentNode} root
 */
export function translate(root) {
  for (const el of root.querySelectorAll("[data-t]"))
    el.textContent = t(/** @type {HTMLElement} */ (el).dataset.t ?? "");
  for (const el of root.querySelectorAll("[data-t-label]")) {
    const words = t(/** @type {HTMLElement} */ (el).dataset.tLabel ?? "");
    el.setAttribute("aria-label", words);
    el.setAttribute("title", words);
  }
  for (const el of root.querySelectorAll("[data-t-hint]")) {
    el.setAttribute("placeholder", t(/** @type {HTMLElement} */ (el).dataset.tHint ?? ""));
  }
}
