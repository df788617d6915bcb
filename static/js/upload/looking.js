// Both logs looked at before they are handed in: what each is, what only a person knows of it, how they lie in time.

import * as api from "../api.js";
import { bytes, duration, number } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { t } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { mappingForm } from "./mapping_form.js";
import { feetInTime, fittingPreset, look } from "./preview.js";
import { previewCard } from "./preview_card.js";

/** @typedef {import("./run.js").Foot} Foot */
const FEET = /** @type {const} */ (["left", "right"]);

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} side
 * @param {(name: Foot) => File | undefined} fileOf
 */
export function makeLooking(app, side, fileOf) {
  /** What is said of each log besides what it says itself, and what the server makes of it. */
  /** @type {Partial<Record<Foot, import("./preview.js").Reading>>} */
  let readings = {};
  /** @type {Partial<Record<Foot, import("./preview.js").Preview>>} */
  let previews = {};
  /** @type {import("./preview.js").NamedMapping[]} */
  let presets = [];

  /**
   * Asks what a log would be read as; a table in an unknown format is read by the preset that fits it.
   * @param {Foot} name
   */
  async function lookAt(name) {
    const file = fileOf(name);
    if (!file) return;
    setText(one(`[data-foot=${name}] .state`, side), `${bytes(file.size)} · ${t("preview.looking")}`);
    try {
      let preview = await look(api, file, readings[name] ?? {});
      if (preview.problem?.code === "unknown_format") {
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
    } catch (error) {
      if (fileOf(name) !== file) return;
      render(one(`[data-foot=${name}] .preview`, side), problemBox(error));
    }
    setText(one(`[data-foot=${name}] .state`, side), bytes(file.size));
  }

  /** @param {Foot} name */
  function showPreview(name) {
    const preview = previews[name];
    const box = one(`[data-foot=${name}] .preview`, side);
    render(box, preview ? html`${previewCard(preview, name)}${questions(name, preview)}` : html``);
    showAskMapping();
    showInTime();
  }

  /**
   * What only a person knows of a log: its rate, how much a count of its magnetometer is, its columns.
   * @param {Foot} name
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
      ${ask_rate && html`<label class="field"><span>${t("preview.ask_rate")}</span><input data-ask="rate_hz" inputmode="decimal" autocomplete="off" value="${reading.rate_hz ?? ""}" /></label>`}
      ${
        ask_field &&
        html`<label class="field"
            ><span>${t("preview.ask_field")}</span
            ><input
              data-ask="field_ut_per_count"
              inputmode="decimal"
              autocomplete="off"
              value="${reading.field_ut_per_count ?? ""}"
          /></label>
          ${suggested && html`<p class="muted">${t("preview.suggested_field", { ut: String(Number(suggested.toPrecision(3))) })}</p>`}`
      }
      ${(ask_rate || ask_field) && html`<button type="button" data-look="${name}">${t("preview.again")}</button>`}
      ${preview.columns.length > 0 && preview.format !== "canonical" && html`<button type="button" class="quiet" data-map="${name}">${t("preview.map_columns")}</button>`}
    </div>`;
  }

  /** The foot whose columns are being mapped. @type {Foot | null} */
  let mapped = null;

  function showAskMapping() {
    const unknown = FEET.find((name) => previews[name]?.problem?.code === "unknown_format" && !readings[name]?.mapping);
    const wanted = mapped ?? unknown ?? null;
    const box = one(".ask-mapping", side);
    const preview = wanted ? previews[wanted] : undefined;
    if (!wanted || !preview) {
      render(box, html``);
      return;
    }
    mappingForm(box, preview, presets, {
      use(mapping) {
        mapped = null;
        // Both feet are recorded by one kind of logger: the other one is read alike, when it has these columns.
        for (const name of FEET) {
          if (!fileOf(name) || (name !== wanted && previews[name]?.problem?.code !== "unknown_format")) continue;
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
    const { left: l, right: r } = previews;
    const time = l && r ? feetInTime(l, r) : null;
    if (!time) return setText(box, "");
    for (const name of FEET) {
      if (time.zero_ns !== null) readings[name] = { ...readings[name], clock_zero_ns: time.zero_ns };
      else if (readings[name]) delete readings[name]?.clock_zero_ns;
    }
    const part = l?.part || r?.part;
    setText(
      box,
      t(time.one_clock ? "preview.one_clock" : "preview.two_clocks", {
        s: number(time.right_after_left_s, 2),
        overlap: duration(time.overlap_s),
      }) + (part ? ` ${t("preview.of_part")}` : ""),
    );
  }

  one(".feet", side).addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("button");
    const again = /** @type {Foot | undefined} */ (button?.dataset.look);
    if (again) {
      const reading = { ...readings[again] };
      for (const field of one(`[data-foot=${again}]`, side).querySelectorAll("[data-ask]")) {
        const { value, dataset } = /** @type {HTMLInputElement} */ (field);
        const said = Number(value.trim().replace(",", "."));
        const key = /** @type {"rate_hz" | "field_ut_per_count"} */ (dataset.ask);
        if (value.trim() !== "" && said > 0) reading[key] = said;
        else delete reading[key];
      }
      readings[again] = reading;
      lookAt(again);
    }
    const map = /** @type {Foot | undefined} */ (button?.dataset.map);
    if (map) {
      mapped = map;
      showAskMapping();
      one(".ask-mapping", side).scrollIntoView({ block: "nearest" });
    }
  });

  return {
    readings: () => readings,
    /** Another file: what was said of the one before does not hold. @param {Foot} name */
    anew(name) {
      delete readings[name];
      delete previews[name];
      showPreview(name);
      lookAt(name);
    },
    /**
     * What the server made of the whole of a log.
     * @param {Foot} name
     * @param {import("./preview.js").Preview} preview
     */
    found(name, preview) {
      previews[name] = preview;
      showPreview(name);
    },
    swap() {
      readings = { left: readings.right, right: readings.left };
      previews = { left: previews.right, right: previews.left };
      mapped = null;
      FEET.forEach(showPreview);
    },
    clear() {
      readings = {};
      previews = {};
      mapped = null;
      FEET.forEach(showPreview);
    },
  };
}
