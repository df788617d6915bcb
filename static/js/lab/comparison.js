// Runs side by side: each figure of each run with its difference to the walk's own track, and over all walks together.

import { dateTime, number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { streamOf, systemOf, word } from "../systems/index.js";

/** @typedef {import("../systems/index.js").System} System */
/**
 * @typedef {{name: string, unit: string, aim: "small" | "large" | "one" | "none"}} Figure
 * @typedef {{
 *   session_id: string, system?: string, title: string, inspector: string, started_at: string, run_id: string | null, run: string,
 *   parameters: Record<string, number>, aids: string[] | null, values: Record<string, number>, differences: Record<string, number>,
 *   comparable: boolean | null, provenance: Record<string, any> | null,
 * }} Row
 * @typedef {{figures: Figure[], rows: Row[]}} Comparison
 */

/** Digits that say something. @param {string} name */
const digits = (name) => (/^nis_|_share$|_percent$|^process_s$/.test(name) ? 2 : /_m$/.test(name) ? 2 : 0);

/**
 * Whether a difference is for the better, for the worse, or neither.
 * @param {Figure} figure
 * @param {number} value
 * @param {number} difference
 * @returns {"good" | "bad" | ""}
 */
export function verdict(figure, value, difference) {
  const gain = {
    small: -difference,
    large: difference,
    one: Math.abs(value - difference - 1) - Math.abs(value - 1),
    none: 0,
  }[figure.aim];
  // What cannot be seen in the figure is no difference.
  if (Math.abs(gain) < 0.5 * 10 ** -digits(figure.name)) return "";
  return gain > 0 ? "good" : "bad";
}

/** @param {Row} row */
export function runWords(row) {
  if (row.run_id === null) return t("lab.own_track");
  if (row.aids && Object.keys(row.parameters).length === 0)
    return row.aids.map((aid) => word(systemOf(row), `aid.${aid}`)).join(" + ");
  return row.run;
}

/** @param {Record<string, number>} parameters */
export const settings = (parameters) =>
  Object.entries(parameters)
    .map(([key, value]) => `${key} = ${value}`)
    .join("\n");

/**
 * Over all walks: of each run by its name, the mean difference of each figure, and on how many walks it is better.
 * @param {Comparison} comparison
 * @returns {{run: string, walks: number, figures: Map<string, {mean: number, better: number, worse: number, walks: number}>}[]}
 */
export function overAllWalks({ figures, rows }) {
  /** @type {Map<string, Row[]>} */
  const byRun = new Map();
  for (const row of rows) {
    if (row.run_id === null || row.comparable === false) continue;
    byRun.set(runWords(row), [...(byRun.get(runWords(row)) ?? []), row]);
  }
  return [...byRun].map(([run, of]) => ({
    run,
    walks: new Set(of.map((row) => row.session_id)).size,
    figures: new Map(
      figures.flatMap((figure) => {
        const known = of.filter((row) => figure.name in row.differences);
        if (known.length === 0) return [];
        const verdicts = known.map((row) => verdict(figure, row.values[figure.name], row.differences[figure.name]));
        const mean = known.reduce((sum, row) => sum + row.differences[figure.name], 0) / known.length;
        return [
          [
            figure.name,
            {
              mean,
              better: verdicts.filter((v) => v === "good").length,
              worse: verdicts.filter((v) => v === "bad").length,
              walks: known.length,
            },
          ],
        ];
      }),
    ),
  }));
}

/** @param {number} value @param {number} places */
const signed = (value, places) => (value > 0 ? `+${number(value, places)}` : number(value, places));

/** @param {System} system @param {Figure} figure */
const head = (system, figure) =>
  html`<th class="num" scope="col">
    ${word(system, `lab.figure.${figure.name}`)}${figure.unit !== "1" && html` <small>${figure.unit}</small>`}
  </th>`;

/**
 * @param {Comparison} comparison
 * @param {boolean} mayRemove
 */
export function comparisonTable(comparison, mayRemove) {
  const { rows } = comparison;
  const system = systemOf(rows[0]);
  const figures = comparison.figures.filter((figure) => rows.some((row) => figure.name in row.values));
  const all = overAllWalks(comparison);
  return html` ${
      all.length > 0 &&
      html`<h3>${t("lab.over_all")}</h3>
        <div class="scroll" tabindex="0" role="region" aria-label="${t("lab.over_all")}">
          <table class="compared" data-testid="over-all">
            <thead>
              <tr>
                <th scope="col">${t("lab.run")}</th>
                <th class="num" scope="col">${t("lab.walks")}</th>
                ${figures.map((figure) => head(system, figure))}
              </tr>
            </thead>
            <tbody>
              ${all.map(
                (run) =>
                  html`<tr>
                    <th scope="row">${run.run}</th>
                    <td class="num">${String(run.walks)}</td>
                    ${figures.map((figure) => {
                      const found = run.figures.get(figure.name);
                      if (!found) return html`<td class="num muted">–</td>`;
                      const tone = found.better > found.worse ? "good" : found.worse > found.better ? "bad" : "";
                      return html`<td class="num">
                        <span class="${tone}">${signed(found.mean, digits(figure.name))}</span
                        >${figure.aim !== "none" && html`<small class="muted">${t("lab.better_on", { n: found.better, all: found.walks })}</small>`}
                      </td>`;
                    })}
                  </tr>`,
              )}
            </tbody>
          </table>
        </div>
        <h3>${t("lab.walk_by_walk")}</h3>`
    }
    <div class="scroll" tabindex="0" role="region" aria-label="${t("lab.comparison")}">
      <table class="compared" data-testid="comparison">
        <thead>
          <tr>
            <th scope="col">${t("lab.run")}</th>
            ${figures.map((figure) => head(system, figure))}
            <th><span class="unseen">${t("lab.actions")}</span></th>
          </tr>
        </thead>
        ${[...new Set(rows.map((row) => row.session_id))].map((id) => {
          const of = rows.filter((row) => row.session_id === id);
          const own = of[0];
          const shown = of.filter((row) => row.run_id !== null).map((row) => `lab:${row.run_id}`);
          return html`<tbody data-walk="${id}">
            <tr class="group">
              <th colspan="${String(figures.length + 2)}" scope="rowgroup">
                <a href="#/sessions/${encodeURIComponent(id)}?run=${["main", ...shown].join(",")}"
                  >${own.title || own.inspector}</a
                >
                <span class="muted">${own.inspector} · ${dateTime(own.started_at)}</span>
              </th>
            </tr>
            ${
              Object.keys(own.values).length === 0 &&
              html`<tr>
                <td colspan="${String(figures.length + 2)}" class="muted">${t("lab.no_own_figures")}</td>
              </tr>`
            }
            ${of.map(
              (row) =>
                html`<tr data-run="${row.run_id ?? ""}">
                  <th scope="row">
                    <span title="${settings(row.parameters)}">${runWords(row)}</span
                    >${row.comparable === false && html`<small class="warn">${t("lab.other_input")}</small>`}
                    ${
                      row.provenance &&
                      html`<details>
                        <summary>${t("lab.provenance")}</summary>
                        ${provenance(systemOf(row), row.provenance)}
                      </details>`
                    }
                  </th>
                  ${figures.map((figure) => cell(figure, row))}
                  <td>
                    ${row.run_id && html`<a href="#/sessions/${encodeURIComponent(id)}?run=main,lab:${row.run_id}">${t("lab.replay")}</a>${mayRemove && html` <button type="button" data-remove-run="${row.run_id}">${t("lab.remove")}</button>`}`}
                  </td>
                </tr>`,
            )}
          </tbody>`;
        })}
      </table>
    </div>`;
}

/**
 * @param {Figure} figure
 * @param {Row} row
 */
function cell(figure, row) {
  const value = row.values[figure.name];
  if (value === undefined) return html`<td class="num muted">–</td>`;
  const difference = row.differences[figure.name];
  const places = digits(figure.name);
  return html`<td class="num">
    ${number(value, places)}${difference !== undefined && html`<small class="${verdict(figure, value, difference) || "muted"}">${signed(difference, places)}</small>`}
  </td>`;
}

/**
 * @param {System} system
 * @param {Record<string, any>} from
 */
function provenance(system, from) {
  const parameters = Object.entries(from.parameters);
  return html`<dl class="mono">
    <dt>${t("lab.engine")}</dt>
    <dd>${from.engine_version} · ${from.engine_sha256.slice(0, 16)}…</dd>
    <dt>${t("lab.parameters")}</dt>
    <dd>${parameters.length === 0 ? t("lab.all_default") : settings(from.parameters)}</dd>
    ${
      from.parameter_set &&
      html`<dt>${t("lab.from_set")}</dt>
        <dd>${from.parameter_set.name} (${String(from.parameter_set.version)})</dd>`
    }
    <dt>${t("report.aid")}</dt>
    <dd>${from.aids.map((/** @type {string} */ aid) => word(system, `aid.${aid}`)).join(", ")}</dd>
    ${from.inputs.map(
      (/** @type {any} */ input) =>
        html`<dt>${streamOf(system, input)} · ${t(`lab.source.${input.source}`)}</dt>
          <dd>${input.sha256}</dd>`,
    )}
    <dt>${t("session.visits")} (${String(from.visits)})</dt>
    <dd>${from.visits_sha256}</dd>
    <dt>${t("session.digest")}</dt>
    <dd>${from.track_sha256}</dd>
  </dl>`;
}
