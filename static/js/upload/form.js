// What is asked for when a walk is handed in: its files, a card for each stream of its system, who it was and where it began.

import { html } from "../html.js";
import { t } from "../i18n.js";
import { keyOf, streamName } from "../systems/index.js";

/** @typedef {import("../systems/index.js").System} System */
/** @typedef {import("../systems/index.js").UploadSlot} UploadSlot */

/**
 * @param {System} system
 * @param {{text: string} | null} refused why they may not hand in
 */
export function uploadForm(system, refused) {
  const slots = system.uploadSlots;
  const card = (/** @type {UploadSlot} */ slot) =>
    html`<div class="slot" data-stream="${slot.stream}" data-testid="${slot.id}">
      <h3>${streamName(system, slot.stream)}</h3>
      ${slot.columns.length > 0 && html`<p class="muted">${t("upload.columns", { columns: columnWords(slot) })}</p>`}
      <div class="row">
        <p class="file muted"></p>
        <button type="button" class="quiet" data-take-off="${slot.stream}" title="${t("upload.take_off")}" hidden>
          ✕
        </button>
      </div>
      <p class="muted state" aria-live="polite"></p>
      <progress max="1" value="0" hidden></progress>
      <div class="preview" data-testid="preview-${slot.stream}"></div>
    </div>`;

  return html`<div class="page">
    <h1 data-t="${keyOf(system, "upload.title")}"></h1>
    <p class="lead" data-t="${keyOf(system, "upload.lead")}"></p>
    ${refused}
    <div class="unfinished"></div>
    <div class="waiting"></div>
    <div class="systems"></div>
    <form novalidate>
      <div class="block">
        <h2 data-t="upload.files"></h2>
        <div class="drop" data-testid="drop">
          <b data-t="${keyOf(system, "upload.drop")}"></b>
          <p class="muted" data-t="${keyOf(system, "upload.formats")}"></p>
          <button type="button" class="choose" data-t="upload.choose"></button>
          <input
            type="file"
            multiple
            hidden
            data-testid="files"
            accept=".csv,.txt,.log,.bin,.dat,.gz,.zst,.zip${system.instrument && ",.toml"}"
          />
        </div>
        ${
          system.exchangeable
            ? html`<div class="slots exchangeable">
                ${card(slots[0])}<button type="button" class="swap" data-t="upload.swap"></button>${card(slots[1])}
              </div>`
            : html`<div class="slots">${slots.map(card)}</div>`
        }
        <div class="same" role="status"></div>
        <p class="in-time" role="status" data-testid="in-time"></p>
        <div class="ask-mapping"></div>
        <p class="visits-file muted"></p>
      </div>
      <div class="block session-facts">
        <h2 data-t="${keyOf(system, "upload.walk")}"></h2>
        <div class="two">
          <label class="field"
            ><span data-t="upload.inspector"></span
            ><select name="inspector"></select
          ></label>
          <label class="field new-name"
            ><span data-t="upload.new_inspector"></span><input name="new_name" autocomplete="off"
          /></label>
        </div>
        <div class="two">
          <label class="field"><span data-t="upload.name"></span><input name="title" autocomplete="off" /></label>
          <label class="field"
            ><span data-t="upload.started_at"></span><input name="started_at" type="datetime-local"
          /></label>
        </div>
        ${system.instrument && instrumentField(system.instrument)} ${!system.placesItself && START}
      </div>
      <div class="answer" aria-live="polite"></div>
      <div class="block working" hidden>
        <p class="words"></p>
        <progress max="1" value="0"></progress>
      </div>
      <div class="row end">
        <button type="button" class="open-walk" data-t="upload.open_without" data-testid="open-walk"></button
        ><button type="button" class="dry" data-t="upload.dry_run" data-testid="dry-run"></button
        ><button class="main-action go" data-t="upload.go"></button>
      </div>
    </form>
    ${system.plan?.()}
  </div>`;
}

/**
 * What the instrument is like: typed, pasted, or a file that is dropped with the logs.
 * @param {{about: string, example: string}} instrument
 */
const instrumentField = ({ about, example }) =>
  html`<label class="field"
    ><span>${t("upload.instrument", { about })}</span
    ><textarea
      name="instrument"
      rows="8"
      spellcheck="false"
      autocomplete="off"
      placeholder="${example}"
      data-testid="instrument"
    ></textarea>
  </label>`;

/** @param {UploadSlot} slot */
const columnWords = ({ columns }) =>
  ["t_s", ...columns.map(({ name, required }) => (required ? name : `${name}?`))].join(", ");

/** Where it began, for a system that cannot tell by itself. */
const START = html`<fieldset>
    <legend data-t="upload.start"></legend>
    <div class="choices">
      <label
        ><input type="radio" name="start" value="marker" checked /><span data-t="upload.start_marker"></span
      ></label>
      <label><input type="radio" name="start" value="position" /><span data-t="upload.start_position"></span></label>
      <label><input type="radio" name="start" value="origin" /><span data-t="upload.start_origin"></span></label>
    </div>
  </fieldset>
  <div class="start-marker two">
    <label class="field"
      ><span data-t="upload.marker"></span
      ><input name="marker" autocomplete="off" autocapitalize="characters" spellcheck="false"
    /></label>
    <p class="muted marker-check"></p>
  </div>
  <div class="start-position three" hidden>
    ${["east", "north", "up"].map((axis) => html`<label class="field"><span data-t="axis.${axis}_m"></span><input name="${axis}" inputmode="decimal" autocomplete="off" value="${axis === "up" ? "0" : ""}" /></label>`)}
  </div>
  <label class="field"
    ><span data-t="upload.heading"></span><input name="heading" inputmode="decimal" autocomplete="off"
  /></label>`;
