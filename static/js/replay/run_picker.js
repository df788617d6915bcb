// What is laid over each other: the runs of the walk, other aids to compute it with, and other walks.

import { dateTime, length } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { keyOf, word } from "../systems/index.js";
import { aidsOf, labName, runByAids } from "./runs.js";

/** @typedef {import("../systems/index.js").System} System */

/** @typedef {{name: string, words?: string, ink: string, dash: number[], width: number, track: import("../sessions/track.js").Track, length_m: number, shown: boolean}} Run `words`: of one with other parameters */
/** @typedef {{id: string, name: string, started_at: string, duration_s: number}} OtherWalk */

/** How the runs that the server keeps are drawn; the others take the colours of people. @type {Record<string, {ink: string, dash: number[], width: number}>} */
const DRAWN = {
  main: { ink: "runA", dash: [], width: 2.4 },
  filtered: { ink: "runA", dash: [2, 4], width: 1.4 },
  without_markers: { ink: "runB", dash: [7, 5], width: 2 },
};

/**
 * @param {string} name
 * @param {number} count of runs by aids that there are already
 */
export const drawnAs = (name, count) =>
  DRAWN[name] ?? {
    ink: ["3", "5", "4", "6"][count % 4],
    dash: [
      [8, 3],
      [3, 3],
      [12, 3, 2, 3],
    ][count % 3],
    width: 1.8,
  };

/**
 * @param {System} system
 * @param {{name: string, words?: string}} run
 * @param {boolean} alone whether there is no other stored run
 */
export function runName(system, { name, words }, alone = false) {
  if (words) return words;
  const aids = aidsOf(system, name);
  if (aids) return aids.map((aid) => word(system, `aid.${aid}`)).join(" + ");
  const own = name === "main" && alone ? "session.run.only" : `session.run.${name}`;
  return t(keyOf(system, own));
}

/** @param {{ink: string, dash: number[]}} run */
const sample = (run) =>
  html`<svg class="long" viewBox="0 0 28 13" aria-hidden="true">
    <line
      class="run-sample"
      data-ink="${run.ink}"
      stroke-dasharray="${run.dash.join(" ")}"
      x1="1"
      y1="6.5"
      x2="27"
      y2="6.5"
    />
  </svg>`;

/**
 * @param {System} system
 * @param {Run[]} runs
 * @param {boolean} alone
 * @param {{arrows: boolean, corrections: number}} more
 */
export function runChoice(system, runs, alone, { arrows, corrections }) {
  return html`<fieldset>
    <legend>${t("session.shown")}</legend>
    <div class="run-choices">
      ${runs.map((run) => html`<label><input type="checkbox" name="run" value="${run.name}" ${run.shown && "checked"} />${sample(run)}<span class="grow">${runName(system, run, alone)}</span><span class="mono muted">${length(run.length_m)}</span></label>`)}
      ${corrections > 0 && html`<label><input type="checkbox" name="arrows" ${arrows && "checked"} /><span class="grow">${t("session.run.arrows")}</span><span class="mono muted">${String(corrections)}</span></label>`}
    </div>
  </fieldset>`;
}

/**
 * Runs of the laboratory that are there and not shown.
 * @param {Run[]} runs
 * @param {import("../lab/view.js").LabRun[]} labRuns
 */
export function labChoice(runs, labRuns) {
  const more = labRuns.filter(
    (run) =>
      run.state === "finished" &&
      Object.keys(run.parameters).length > 0 &&
      !runs.some(({ name }) => name === labName(run.id)),
  );
  return (
    more.length > 0 &&
    html`<fieldset>
      <legend>${t("sessions.runs.in_lab")}</legend>
      <p class="row">
        ${more.map((run) => html`<button type="button" data-lab="${labName(run.id)}">+ ${run.name}</button>`)}
      </p>
    </fieldset>`
  );
}

/**
 * @param {System} system
 * @param {Run[]} runs
 * @param {string | null} computing the run that is on its way
 * @param {boolean} may whether they may have others computed
 */
export function aidsChoice(system, runs, computing, may) {
  const there = new Set(runs.map((run) => run.name));
  if (!may) return html`<p class="muted">${t("sessions.runs.not_yours")}</p>`;
  return html`<details>
    <summary>${t("sessions.runs.by_aids")}</summary>
    <p class="muted">${t("sessions.runs.hint")}</p>
    <p class="row">
      ${system.ladder.map((aids) => html`<button type="button" data-aids="${aids.join("+")}" ${(computing !== null || there.has(runByAids(system, aids))) && "disabled"}>${aids.length === 1 ? t("sessions.runs.only", { aid: word(system, `aid.${aids[0]}`) }) : `+ ${word(system, `aid.${aids[aids.length - 1]}`)}`}</button>`)}
    </p>
    <fieldset>
      <legend>${t("sessions.runs.chosen")}</legend>
      <div class="choices">
        ${system.aids.map((aid) => html`<label><input type="checkbox" name="aid" value="${aid}" ${aid === system.aids[0] && "checked"} />${word(system, `aid.${aid}`)}</label>`)}
        <button type="button" data-compute ${computing !== null && "disabled"}>${t("sessions.runs.compute")}</button>
      </div>
    </fieldset>
    ${computing !== null && html`<p role="status">${t("sessions.runs.computing", { run: runName(system, { name: computing }) })}</p>`}
  </details>`;
}

/**
 * @param {{id: string, name: string, ink: string}[]} beside
 * @param {OtherWalk[] | null} others null until they were asked for
 */
export function walkChoice(beside, others) {
  const free = (others ?? []).filter((other) => !beside.some((walk) => walk.id === other.id));
  return html`<fieldset>
    <legend>${t("beside.title")}</legend>
    ${beside.map(
      (walk) =>
        html`<p class="row">
          <svg class="long" viewBox="0 0 28 13" aria-hidden="true">
            <line class="run-sample" data-ink="${walk.ink}" x1="1" y1="6.5" x2="27" y2="6.5" /></svg
          ><span class="grow">${walk.name}</span
          ><button type="button" data-remove="${walk.id}">${t("beside.remove")}</button>
        </p>`,
    )}
    <select name="beside" aria-label="${t("beside.add")}">
      <option value="">${t("beside.add")}</option>
      ${free.map((other) => html`<option value="${other.id}">${other.name} · ${dateTime(other.started_at)}</option>`)}
    </select>
  </fieldset>`;
}
