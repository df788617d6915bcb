// The logs looked at before they are handed in: what each is, what only a person knows of it, how they lie in time.

import * as api from "../api.js";
import { bytes, duration, number } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { t } from "../i18n.js";
import { streamName, word } from "../systems/index.js";
import { problemBox } from "../ui/problem.js";
import { mappingForm } from "./mapping_form.js";
import { asksForColumns, fittingPreset, logsInTime, look } from "./preview.js";
import { previewCard } from "./preview_card.js";

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} side
 * @param {import("../systems/index.js").System} system
 * @param {(stream: string) => File | undefined} fileOf
 * @param {() => void} onLooked
 */
export function makePreviewPanel(app, side, system, fileOf, onLooked) {
  const slots = system.uploadSlots;
  /** What is said of each log besides what it says itself, and what the server makes of it. */
  /** @type {Record<string, import("./preview.js").Reading>} by stream */
  let readings = {};
  /** @type {Record<string, import("./preview.js").Preview>} by stream */
  let previews = {};
  /** @type {import("./preview.js").NamedMapping[]} */
  let presets = [];
  const card = (/** @type {string} */ stream) => one(`[data-stream="${CSS.escape(stream)}"]`, side);

  /**
   * Asks what a log would be read as; a table in an unknown format is read by the preset that fits it.
   * @param {string} name
   */
  async function lookAt(name) {
    const file = fileOf(name);
    if (!file || slots.find(({ stream }) => stream === name)?.kind !== "imu") return;
    setText(one(".state", card(name)), `${bytes(file.size)} · ${t("upload.preview.looking")}`);
    try {
      let preview = await look(api, file, readings[name] ?? {});
      if (asksForColumns(preview)) {
        presets = await api.mappings();
        const preset = fittingPreset(presets, preview);
        if (preset) {
          readings[name] = { ...readings[name], mapping: preset.mapping };
          preview = await look(api, file, readings[name] ?? {});
        }
      }
      if (fileOf(name) !== file) return;
      previews[name] = preview;
      showPreview(name);
      onLooked();
    } catch (error) {
      if (fileOf(name) !== file) return;
      render(one(".preview", card(name)), problemBox(error));
    }
    setText(one(".state", card(name)), bytes(file.size));
  }

  /** @param {string} name */
  function showPreview(name) {
    const preview = previews[name];
    const box = one(".preview", card(name));
    render(
      box,
      preview
        ? html`${previewCard(preview, streamName(system, name), !system.placesItself)}${questions(name, preview)}`
        : html``,
    );
    showAskMapping();
    showInTime();
  }

  /**
   * What only a person knows of a log: its rate, how much a count of its magnetometer is, its columns.
   * @param {string} name
   * @param {import("./preview.js").Preview} preview
   */
  function questions(name, preview) {
    const reading = readings[name] ?? {};
    const ask_rate = preview.problem?.code === "mapping_needed" || reading.rate_hz !== undefined;
    const ask_field = preview.notes.includes("field_without_unit");
    const suggested =
      preview.field_in_counts && preview.survey.field_mean_ut
        ? (app.site.field_ut ?? 50) / preview.survey.field_mean_ut
        : null;
    if (!ask_rate && !ask_field && !(reading.mapping || preview.columns.length > 0)) return null;
    return html`<div class="asked">
      ${ask_rate && html`<label class="field"><span>${t("upload.preview.ask_rate")}</span><input data-ask="rate_hz" inputmode="decimal" autocomplete="off" value="${reading.rate_hz ?? ""}" /></label>`}
      ${
        ask_field &&
        html`<label class="field"
            ><span>${t("upload.preview.ask_field")}</span
            ><input
              data-ask="field_ut_per_count"
              inputmode="decimal"
              autocomplete="off"
              value="${reading.field_ut_per_count ?? ""}"
          /></label>
          ${suggested && html`<p class="muted">${t("upload.preview.suggested_field", { ut: String(Number(suggested.toPrecision(3))) })}</p>`}`
      }
      ${(ask_rate || ask_field) && html`<button type="button" data-look="${name}">${t("upload.preview.again")}</button>`}
      ${preview.columns.length > 0 && preview.format !== "canonical" && html`<button type="button" class="quiet" data-map="${name}">${t("upload.preview.map_columns")}</button>`}
    </div>`;
  }

  /** The stream whose columns are being mapped. @type {string | null} */
  let mapped = null;

  function showAskMapping() {
    const unknown = slots.find(({ stream }) => asksForColumns(previews[stream]) && !readings[stream]?.mapping);
    const wanted = mapped ?? unknown?.stream ?? null;
    const box = one(".ask-mapping", side);
    const preview = wanted ? previews[wanted] : undefined;
    if (!wanted || !preview) {
      render(box, html``);
      return;
    }
    mappingForm(box, preview, presets, {
      use(mapping) {
        mapped = null;
        // Streams are recorded by one kind of logger: the others are read alike, when they have these columns.
        for (const { stream: name } of slots) {
          if (!fileOf(name) || (name !== wanted && !asksForColumns(previews[name]))) continue;
          readings[name] = { ...readings[name], mapping };
          lookAt(name);
        }
      },
      async saved() {
        presets = await api.mappings().catch(() => presets);
      },
    });
  }

  function showInTime() {
    const box = one(".in-time", side);
    const looked = slots.flatMap(({ stream }) => previews[stream] ?? []);
    const time = logsInTime(looked);
    if (!time) return setText(box, "");
    for (const { stream: name } of slots) {
      if (time.zero_ns !== null) readings[name] = { ...readings[name], clock_zero_ns: time.zero_ns };
      else if (readings[name]) delete readings[name]?.clock_zero_ns;
    }
    const part = looked.some((preview) => preview.part);
    setText(
      box,
      word(system, time.one_clock ? "upload.preview.one_clock" : "upload.preview.two_clocks", {
        s: number(time.second_after_first_s, 2),
        spread: number(time.spread_s, 2),
        overlap: duration(time.overlap_s),
      }) + (part ? ` ${t("upload.preview.of_part")}` : ""),
    );
  }

  one(".slots", side).addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("button");
    const again = button?.dataset.look;
    if (again) {
      const reading = { ...readings[again] };
      for (const field of card(again).querySelectorAll("[data-ask]")) {
        const { value, dataset } = /** @type {HTMLInputElement} */ (field);
        const said = Number(value.trim().replace(",", "."));
        const key = /** @type {"rate_hz" | "field_ut_per_count"} */ (dataset.ask);
        if (value.trim() !== "" && said > 0) reading[key] = said;
        else delete reading[key];
      }
      readings[again] = reading;
      lookAt(again);
    }
    const map = button?.dataset.map;
    if (map) {
      mapped = map;
      showAskMapping();
      one(".ask-mapping", side).scrollIntoView({ block: "nearest" });
    }
  });

  return {
    readings: () => readings,
    previews: () => Object.values(previews),
    /** Another file: what was said of the one before does not hold. @param {string} name */
    anew(name) {
      delete readings[name];
      delete previews[name];
      showPreview(name);
      lookAt(name);
    },
    /**
     * What the server made of the whole of a log.
     * @param {string} name
     * @param {import("./preview.js").Preview} preview
     */
    found(name, preview) {
      previews[name] = preview;
      showPreview(name);
    },
    swap() {
      readings = exchanged(readings, slots);
      previews = exchanged(previews, slots);
      mapped = null;
      slots.forEach(({ stream }) => showPreview(stream));
    },
    clear() {
      readings = {};
      previews = {};
      mapped = null;
      slots.forEach(({ stream }) => showPreview(stream));
    },
  };
}

/**
 * What belongs to the two streams, the other way about.
 * @template T
 * @param {Record<string, T>} byStream
 * @param {import("../systems/index.js").UploadSlot[]} slots of an exchangeable system
 * @returns {Record<string, T>}
 */
export function exchanged(byStream, [{ stream: first }, { stream: second }]) {
  return {
    ...(second in byStream && { [first]: byStream[second] }),
    ...(first in byStream && { [second]: byStream[first] }),
  };
}
