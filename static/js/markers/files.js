// A file of markers in four steps: choose it, say which column is what, look at the exact difference, apply. And the
// files that were applied, each of which can be taken back.

import * as api from "../api.js";
import { dateTime, number } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { t, tOr } from "../i18n.js";
import { sentence } from "../sentences.js";
import { problemBox } from "../ui/problem.js";
import { sourceOf } from "./source.js";

/** @typedef {import("../map/survey.js").Difference} Difference */
/** @typedef {Record<string, any> & {frame: "local" | "geographic"}} Mapping */
/**
 * @typedef {{
 *   id: string, state: "compared" | "applied" | "reverted", file_name: string | null, whole_table: boolean, added: number, changed: number, removed: number,
 *   unchanged: number, reason: string, created_at: string, applied_at: string | null, applied_by: string | null, reverted_at: string | null,
 * }} Import
 * @typedef {{code: string, level: "error" | "warning", line: number | null, marker: string | null, detail: string,
 *   figures?: import("../sentences.js").Figures | null, suggested: Mapping | null}} Finding
 * @typedef {Import & {
 *   encoding: string, columns: string[], sample: string[][], rows: number, mapping: Mapping | null, findings: Finding[],
 *   finding_counts: Record<string, number>, differences: Difference[],
 * }} ImportView
 */

/** Differences and findings that are listed; the map shows all. */
const MOST_ROWS = 200;
/** A move of more than this is no chance of the survey. */
const MANY_SIGMAS = 3;
const FRAMES = { local: ["e_m", "n_m", "u_m"], geographic: ["latitude_deg", "longitude_deg", "height_m"] };
const KINDS = /** @type {const} */ (["added", "changed", "removed", "unchanged"]);

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} el
 * @param {{shown: (differences: Difference[]) => void, changed: () => Promise<void>, closed: () => void}} on
 */
export function makeFiles(app, el, on) {
  /** @type {ImportView | null} */
  let file = null;
  /** @type {Import[]} */
  let list = [];
  /** @type {{text: string}} */
  let answer = html``;
  /** The kind of difference that is listed. @type {string} */
  let kind = "";
  /** The file that is about to be taken back, and why. */
  let reverting = "";
  let why = "";

  const file_name = (/** @type {Import} */ one) => one.file_name ?? t("markers.file_by_program");

  function draw() {
    on.shown(file?.state === "compared" ? file.differences : []);
    // The field for a file stays the same element: a list that comes late must not take away what was just chosen.
    render(
      el,
      html`<div class="list-title">
          <h2></h2>
          <button type="button" data-step="back"></button>
        </div>
        <div class="wizard" data-testid="wizard">
          <div class="answer" aria-live="polite"></div>
          <label class="drop"
            ><b>${t("markers.drop")}</b><span class="muted">${t("markers.drop_explain")}</span
            ><input type="file" accept=".csv,.txt,.tsv,text/csv,text/plain" data-testid="markers-file"
          /></label>
          <div class="step"></div>
        </div>`,
    );
    setText(
      one("h2", el),
      !file ? t("markers.import") : sourceOf(file.file_name) ? t("markers.by_survey") : file_name(file),
    );
    setText(one("[data-step=back]", el), t(file ? "markers.another_file" : "markers.back"));
    one(".drop", el).hidden = file !== null;
    render(one(".answer", el), answer);
    render(one(".step", el), file ? steps(file) : past());
  }

  function past() {
    return html` <h3>${t("markers.files")}</h3>
      ${list.length === 0 && html`<p class="muted">${t("markers.no_files")}</p>`}
      ${list.map(
        (one) =>
          html`<div class="card" data-testid="import-row" data-state="${one.state}">
            <span class="line"
              ><b class="grow">${sourceOf(one.file_name) ?? file_name(one)}</b
              ><span class="tag${one.state === "applied" && " good"}">${t(`markers.state.${one.state}`)}</span></span
            >
            <span class="sub">${counts(one)}</span>
            <span class="sub"
              >${dateTime(one.reverted_at ?? one.applied_at ?? one.created_at)}${one.applied_by && html` · <bdi>${one.applied_by}</bdi>`}${one.reason && html` · <bdi>${one.reason}</bdi>`}</span
            >
            <span class="row end"
              >${one.state === "applied" && one.id !== reverting && html`<button type="button" data-revert="${one.id}">${t("markers.revert")}</button>`}${one.state === "compared" && html`<button type="button" data-open="${one.id}">${t("markers.go_on")}</button>`}</span
            >
            ${
              one.state === "applied" &&
              one.id === reverting &&
              html`<form class="revert">
                <label class="field"
                  ><span>${t("markers.reason")}</span><input name="reason" required maxlength="500" autocomplete="off"
                /></label>
                <div class="row end">
                  <button type="button" data-step="keep">${t("cancel")}</button
                  ><button class="main-action" data-testid="revert-import">${t("markers.revert")}</button>
                </div>
              </form>`
            }
          </div>`,
      )}`;
  }

  const counts = (/** @type {Import} */ one) => KINDS.map((k) => t(`markers.n.${k}`, { n: one[k] })).join(" · ");

  /** @param {ImportView} view */
  function steps(view) {
    const errors = view.findings.some((finding) => finding.level === "error");
    const warnings = view.findings.some((finding) => finding.level === "warning");
    return html` <section data-testid="mapping">
        <h3>1 · ${t("markers.step.columns")}</h3>
        <p class="muted">${t("markers.read_as", { rows: view.rows, encoding: view.encoding })}</p>
        <form class="mapping">
          ${mapping(view)}
          <label class="check"
            ><input type="checkbox" name="whole_table" ${view.whole_table && html` checked`} />
            ${t("markers.whole_table")}</label
          >
        </form>
        <div class="scroll sample" tabindex="0" role="region" aria-label="${t("markers.sample")}">
          <table>
            <thead>
              <tr>
                ${view.columns.map((column) => html`<th scope="col">${column || "–"}</th>`)}
              </tr>
            </thead>
            <tbody>
              ${view.sample.slice(0, 3).map(
                (row) =>
                  html`<tr>
                    ${row.map((cell) => html`<td>${cell}</td>`)}
                  </tr>`,
              )}
            </tbody>
          </table>
        </div>
      </section>
      <section data-testid="findings">
        <h3>2 · ${t("markers.step.check")}</h3>
        ${view.findings.length === 0 ? html`<p><span class="tag good">${t("markers.nothing_odd")}</span></p>` : findings(view)}
      </section>
      <section data-testid="difference">
        <h3>3 · ${t("markers.step.difference")}</h3>
        ${errors ? html`<p class="muted">${t("markers.after_errors")}</p>` : differences(view)}
      </section>
      <section>
        <h3>4 · ${t("markers.step.apply")}</h3>
        <form class="apply">
          <label class="field"
            ><span>${t("markers.reason")}</span><input name="reason" required maxlength="500" autocomplete="off"
          /></label>
          ${warnings && html`<label class="check"><input type="checkbox" name="accept" required /> ${t("markers.accept_warnings")}</label>`}
          <div class="row end">
            <button type="button" data-step="give-up">${t("markers.give_up")}</button
            ><button
              class="main-action"
              data-testid="apply-import"
              ${(errors || view.added + view.changed + view.removed === 0) && html` disabled`}
            >
              ${t("markers.apply")}
            </button>
          </div>
        </form>
      </section>`;
  }

  /** @param {ImportView} view */
  function mapping({ columns, mapping }) {
    const frame = mapping?.frame ?? "local";
    const select = (/** @type {string} */ field, optional = false) =>
      html`<label class="field"
        ><span>${t(`markers.column.${field}`)}</span
        ><select name="${field}">
          ${(optional || mapping === null) && html`<option value="">–</option>`}${columns.map((column, i) => html`<option value="${i}" ${mapping?.[field] === i && html` selected`}>${column || t("markers.column_number", { n: i + 1 })}</option>`)}
        </select></label
      >`;
    return html`<fieldset>
        <legend>${t("markers.frame")}</legend>
        <div class="choices">
          ${Object.keys(FRAMES).map((f) => html`<label><input type="radio" name="frame" value="${f}" ${f === frame && html` checked`} />${t(`markers.frame.${f}`)}</label>`)}
        </div>
      </fieldset>
      <div class="two">${select("name")}${FRAMES[frame].map((field, i) => select(field, i === 2))}</div>`;
  }

  /** @param {ImportView} view */
  function findings(view) {
    return html`<ul class="findings">
        ${view.findings.slice(0, MOST_ROWS).map(
          (finding) =>
            html`<li data-level="${finding.level}">
              <span class="tag ${finding.level === "error" ? "bad" : "warn"}"
                >${t(`markers.level.${finding.level}`)}</span
              >
              <b>${tOr(`markers.finding.${finding.code}`, finding.code)}</b>
              <span class="muted"
                >${finding.line !== null && t("markers.line", { line: finding.line })} ${finding.marker}</span
              >
              <p>
                ${tOr(`markers.todo.${finding.code}`, "")}
                <span class="muted">${sentence(null, `markers.told.${finding.code}`, finding)}</span>
              </p>
              ${finding.suggested && html`<button type="button" data-suggested="${JSON.stringify(finding.suggested)}">${t("markers.use_suggestion")}</button>`}
            </li>`,
        )}
      </ul>
      ${Object.entries(view.finding_counts)
        .filter(([code, n]) => n > view.findings.filter((f) => f.code === code).length)
        .map(
          ([code, n]) =>
            html`<p class="muted">${t("markers.more_findings", { n, what: tOr(`markers.finding.${code}`, code) })}</p>`,
        )}`;
  }

  /** @param {ImportView} view */
  function differences(view) {
    const rows = view.differences.filter((d) => kind === "" || d.change === kind);
    const surveyed = rows.some((d) => d.sigma_m);
    return html` <div class="choices">
        ${KINDS.map((k) => html`<button type="button" data-kind="${k}" aria-pressed="${String(kind === k)}" ${(view[k] === 0 || k === "unchanged") && html` disabled`}>${t(`markers.n.${k}`, { n: view[k] })}</button>`)}
      </div>
      ${
        rows.length > 0 &&
        html`<div class="scroll" tabindex="0" role="region" aria-label="${t("markers.step.difference")}">
          <table>
            <thead>
              <tr>
                <th>${t("markers.name")}</th>
                <th>${t("markers.what")}</th>
                <th class="num">${t("markers.moves_m")}</th>
                <th class="num">${t("markers.rises_m")}</th>
                ${
                  surveyed &&
                  html`<th class="num">${t("markers.sigmas")}</th>
                    <th class="num">${t("markers.sigma_m")}</th>`
                }
                <th class="num">${t("markers.line_short")}</th>
              </tr>
            </thead>
            <tbody>
              ${rows.slice(0, MOST_ROWS).map(
                (d) =>
                  html`<tr>
                    <td><button type="button" class="quiet name" data-difference="${d.name}">${d.name}</button></td>
                    <td>${t(`markers.change.${d.change}`)}</td>
                    <td class="num${(d.moved_m ?? 0) > 1 && " warn"}">${number(d.moved_m, 3)}</td>
                    <td class="num">${number(d.raised_m, 3)}</td>
                    ${
                      surveyed &&
                      html`<td class="num${(sigmas(d) ?? 0) > MANY_SIGMAS && " warn"}">${number(sigmas(d), 1)}</td>
                        <td class="num">${d.sigma_m && d.sigma_m.map((sigma) => number(sigma, 3)).join(" ")}</td>`
                    }
                    <td class="num">${d.line}</td>
                  </tr>`,
              )}
            </tbody>
          </table>
        </div>`
      }
      ${rows.length > MOST_ROWS && html`<p class="muted">${t("markers.shown_of", { shown: MOST_ROWS, all: rows.length })}</p>`}`;
  }

  /** How many of its sigmas a marker moves by, on the mean of the axes. @param {Difference} d @returns {number | null} */
  function sigmas({ before, after, sigma_m, raised_m }) {
    if (!before || !after || !sigma_m) return null;
    const moves = [after.e_m - before.e_m, after.n_m - before.n_m, ...(raised_m === null ? [] : [raised_m])];
    const squares = moves.map((move, axis) => (move / Math.max(sigma_m[axis], 1e-4)) ** 2);
    return Math.sqrt(squares.reduce((sum, square) => sum + square, 0) / squares.length);
  }

  /** @param {() => Promise<void>} work */
  async function run(work) {
    answer = html``;
    el.setAttribute("aria-busy", "true");
    try {
      await work();
    } catch (error) {
      answer = problemBox(error);
      if (error instanceof api.Problem && error.code === "table_moved_on" && file) {
        answer = html`${answer}
          <div class="row end"><button type="button" data-step="again">${t("markers.compare_again")}</button></div>`;
      } else if (error instanceof api.Problem && error.code === "changed_since" && Array.isArray(error.current)) {
        answer = html`${answer}
          <ul>
            ${error.current.map((c) => html`<li><b>${c.name}</b></li>`)}
          </ul>
          <div class="row end"><button type="button" data-step="skip">${t("markers.revert_others")}</button></div>`;
      }
    }
    el.removeAttribute("aria-busy");
    draw();
  }

  /** The file once more, as the form or a suggestion has it. @param {Mapping | null} mapping */
  const readAgain = (mapping) =>
    run(async () => {
      if (!file) return;
      const whole_table = /** @type {HTMLInputElement} */ (one("[name=whole_table]", el)).checked;
      file = await api.readImport(file.id, { mapping, whole_table });
    });

  /** What a file would change, in the middle of the map. @param {ImportView} view */
  function compared(view) {
    file = view;
    app.stage.show(
      view.differences.flatMap(({ before, after }) =>
        [before, after].flatMap((place) =>
          place ? [/** @type {import("../geometry.js").EastNorth} */ ([place.e_m, place.n_m])] : [],
        ),
      ),
    );
  }

  /** @returns {Mapping | null} null while a column is missing */
  function chosenMapping() {
    const data = new FormData(/** @type {HTMLFormElement} */ (one("form.mapping", el)));
    const frame = data.get("frame") === "geographic" ? "geographic" : "local";
    const was = file?.mapping ? [file.mapping.name, ...FRAMES[file.mapping.frame].map((f) => file?.mapping?.[f])] : [];
    /** @type {Mapping} */
    const mapping = { frame };
    for (const [i, field] of ["name", ...FRAMES[frame]].entries()) {
      // A change of the frame keeps the columns: north and latitude are one axis, east and longitude the other.
      const kept = frame === file?.mapping?.frame ? was[i] : was[[0, 2, 1, 3][i]];
      const text = data.has(field) ? data.get(field) : kept;
      if (text === "" || text === null || text === undefined) {
        if (i < 3) return null;
        mapping[field] = null;
      } else mapping[field] = Number(text);
    }
    return mapping;
  }

  const fetchList = async () => {
    list = await api.markerImports();
  };
  const revert = (skip = false) =>
    run(async () => {
      await api.revertImport(reverting, { reason: why, skip_changed: skip });
      reverting = "";
      await Promise.all([fetchList(), on.changed()]);
      answer = html`<div class="done" role="status">${t("markers.reverted")}</div>`;
    });

  const onClick = (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target).closest("button");
    if (!target) return;
    const { step, revert: back, open, suggested, kind: asked, difference } = target.dataset;
    if (back !== undefined || step === "keep") {
      reverting = back ?? "";
      answer = html``;
      draw();
      return el.querySelector(/** @type {"input"} */ ("form.revert input"))?.focus();
    }
    if (step === "skip") return revert(true);
    if (open)
      return run(async () => {
        file = await api.markerImport(open);
      });
    if (suggested) return readAgain(JSON.parse(suggested));
    if (asked) {
      kind = kind === asked ? "" : asked;
      return draw();
    }
    if (difference) {
      const place = file?.differences.find((d) => d.name === difference);
      const at = place?.after ?? place?.before;
      if (at) app.stage.goTo([at.e_m, at.n_m], 4);
      return;
    }
    if (step === "again") return readAgain(file?.mapping ?? null);
    if (step === "give-up")
      return run(async () => {
        if (file) await api.giveUpImport(file.id);
        file = null;
        await fetchList();
      });
    if (step === "back") {
      if (!file) return on.closed();
      file = null;
      return run(fetchList);
    }
  };
  const onChange = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    const chosen = input.type === "file" ? input.files?.[0] : undefined;
    if (chosen) {
      return run(async () => {
        kind = "";
        compared(await api.sendImport(chosen, chosen.name));
        input.value = "";
      });
    }
    if (input.closest("form.mapping")) {
      const mapping = chosenMapping();
      if (mapping || input.name === "whole_table") readAgain(mapping);
    }
  };
  const onSubmit = (/** @type {Event} */ event) => {
    event.preventDefault();
    const form = /** @type {HTMLFormElement} */ (event.target);
    const data = new FormData(form);
    if (form.matches("form.revert")) {
      why = String(data.get("reason"));
      return revert();
    }
    if (!form.matches("form.apply") || !file) return;
    const { id } = file;
    run(async () => {
      const applied = await api.applyImport(id, {
        reason: data.get("reason"),
        accept_warnings: data.get("accept") === "on",
      });
      file = null;
      await Promise.all([fetchList(), on.changed()]);
      answer = html`<div class="done" role="status">
        ${t("markers.imported", { file: applied.file_name ?? "", added: applied.added, changed: applied.changed, removed: applied.removed, unchanged: applied.unchanged })}
      </div>`;
    });
  };
  el.addEventListener("click", onClick);
  el.addEventListener("change", onChange);
  el.addEventListener("submit", onSubmit);

  return {
    /** @param {string} [surveyed] the session whose survey is compared with the table at once */
    open(surveyed) {
      answer = html``;
      draw();
      return run(async () => {
        await fetchList();
        if (surveyed) compared(await api.importOfSurvey(surveyed));
      });
    },
    close() {
      el.removeEventListener("click", onClick);
      el.removeEventListener("change", onChange);
      el.removeEventListener("submit", onSubmit);
    },
  };
}
