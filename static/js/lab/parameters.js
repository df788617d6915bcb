// The parameters that may be turned: unit, range, default, what differs from it, and back again.

import { html, one, render } from "../html.js";
import { has, t } from "../i18n.js";
import { keyOf, word } from "../systems/index.js";

/** @typedef {import("../systems/index.js").System} System */
/**
 * @typedef {{key: string, unit: string, group: string, about: string, least: number, most: number, default: number}} Parameter
 * @typedef {{id: string, name: string, about: string, parameters: Record<string, number>, version: number, created_by: string | null, updated_at: string}} ParameterSet
 */

/** @param {string} unit */
export const unitWords = (unit) => (unit === "1" ? "" : unit);

/** A number as it was set, to the last digit. @param {number} value */
export const exact = (value) => String(value).replace("-", "−");

/**
 * What was typed, or why it is not taken.
 * @param {Parameter} parameter
 * @param {string} text
 * @returns {{value: number} | {wrong: string}}
 */
export function readValue(parameter, text) {
  const value = Number(text.trim().replace("−", "-").replace(",", "."));
  if (text.trim() !== "" && Number.isFinite(value) && value >= parameter.least && value <= parameter.most)
    return { value };
  return {
    wrong: t("lab.out_of_range", {
      least: exact(parameter.least),
      most: exact(parameter.most),
      unit: unitWords(parameter.unit),
    }),
  };
}

/** What a parameter means; in the server's words where the page has none. @param {System} system @param {Parameter} parameter */
function about(system, { key, about }) {
  const found = keyOf(system, `lab.about.${key}`);
  return has(found) ? t(found) : about;
}

/**
 * @param {HTMLElement} box
 * @param {System} system whose parameters they are
 * @param {Parameter[]} parameters
 * @param {Map<string, number>} values only what differs from the default
 * @param {() => void} changed
 */
export function makeParameterTable(box, system, parameters, values, changed) {
  const groups = [...new Set(parameters.map((p) => p.group))];
  render(
    box,
    html`<div class="scroll" tabindex="0" role="region" aria-label="${t("lab.parameters")}">
      <table class="parameters" data-testid="parameters">
        <thead>
          <tr>
            <th>${t("lab.parameter")}</th>
            <th>${t("lab.value")}</th>
            <th>${t("lab.unit")}</th>
            <th class="num">${t("lab.default")}</th>
            <th class="num">${t("lab.range")}</th>
            <th><span class="unseen">${t("lab.reset")}</span></th>
          </tr>
        </thead>
        ${groups.map(
          (group) =>
            html`<tbody>
              <tr class="group">
                <th colspan="6" scope="rowgroup">${word(system, `lab.group.${group}`)}</th>
              </tr>
              ${parameters
                .filter((p) => p.group === group)
                .map(
                  (p) =>
                    html`<tr data-parameter="${p.key}">
                      <td><span class="mono">${p.key}</span><small class="muted">${about(system, p)}</small></td>
                      <td>
                        <input inputmode="decimal" autocomplete="off" aria-label="${p.key}" /><small
                          class="bad"
                          role="alert"
                        ></small>
                      </td>
                      <td>${unitWords(p.unit)}</td>
                      <td class="num">${exact(p.default)}</td>
                      <td class="num">${exact(p.least)} … ${exact(p.most)}</td>
                      <td>
                        <button type="button" data-reset aria-label="${t("lab.reset")} ${p.key}" hidden>
                          ${t("lab.reset")}
                        </button>
                      </td>
                    </tr>`,
                )}
            </tbody>`,
        )}
      </table>
    </div>`,
  );
  const byKey = new Map(parameters.map((p) => [p.key, p]));
  const row = (/** @type {string} */ key) =>
    /** @type {HTMLElement} */ (box.querySelector(`[data-parameter="${CSS.escape(key)}"]`));

  /** @param {Parameter} p */
  function showRow(p) {
    const el = row(p.key);
    const isChanged = values.has(p.key);
    /** @type {HTMLInputElement} */ (el.querySelector("input")).value = String(values.get(p.key) ?? p.default);
    el.classList.toggle("changed", isChanged);
    one("[data-reset]", el).hidden = !isChanged;
    one("[role=alert]", el).textContent = "";
  }

  function show() {
    parameters.forEach(showRow);
  }

  box.addEventListener("change", (event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    const el = /** @type {HTMLElement | null} */ (input.closest("[data-parameter]"));
    const p = byKey.get(el?.dataset.parameter ?? "");
    if (!el || !p) return;
    const read = readValue(p, input.value);
    if ("wrong" in read) {
      one("[role=alert]", el).textContent = read.wrong;
      input.setAttribute("aria-invalid", "true");
      changed();
      return;
    }
    input.removeAttribute("aria-invalid");
    if (read.value === p.default) values.delete(p.key);
    else values.set(p.key, read.value);
    showRow(p);
    changed();
  });
  box.addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("[data-reset]");
    const el = /** @type {HTMLElement | null} */ (button?.closest("[data-parameter]") ?? null);
    const p = byKey.get(el?.dataset.parameter ?? "");
    if (!el || !p) return;
    values.delete(p.key);
    el.querySelector("input")?.removeAttribute("aria-invalid");
    showRow(p);
    el.querySelector("input")?.focus();
    changed();
  });
  show();
  return { show, isWrong: () => box.querySelector("[aria-invalid]") !== null };
}
