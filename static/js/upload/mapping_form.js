// Which column of a table is which channel: asked where the format is not known, and kept as a preset.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { t, tOr } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/**
 * @typedef {import("./preview.js").Mapping} Mapping
 * @typedef {import("./preview.js").Preview} Preview
 */

const AXES = /** @type {const} */ (["x", "y", "z"]);
/** @type {Record<string, string[]>} */
const UNITS = {
  time: ["s", "ms", "us", "ns", "samples", "date_time", "days", "ticks", "ticks10_khz"],
  gyr: ["deg_s", "rad_s", "mdeg_s"],
  acc: ["m_s2", "g", "mg"],
  mag: ["ut", "gauss", "mgauss", "nt", "counts"],
  pressure: ["hpa", "pa", "kpa", "mmhg"],
};
/** How a column's name begins, in the spellings that loggers use. @type {Record<string, RegExp>} */
const LIKE = {
  time: /^(t|time|timestamp|secs?|时间|ts)\b|time/iu,
  gyr: /gyr|^w|omega|rate|角速度/iu,
  acc: /acc|^a|^f|加速度/iu,
  mag: /mag|^[mhb]|磁/iu,
  pressure: /press|baro|气压/iu,
};

/**
 * A first guess by the names: three columns that differ in their last x, y, z.
 * @param {string[]} columns
 * @returns {Record<string, string>} field of the form → column
 */
export function guess(columns) {
  /** @type {Record<string, string>} */
  const found = {};
  const used = new Set();
  for (const channel of ["gyr", "acc", "mag"]) {
    const axis = (/** @type {string} */ letter) =>
      columns.find(
        (name) =>
          !used.has(name) &&
          LIKE[channel].test(name) &&
          new RegExp(`(^|[^a-z])${letter}([^a-z]|$)|${letter}(\\W.*)?$`, "iu").test(name.replace(/\(.*|\[.*/u, "")),
      );
    const three = AXES.map(axis);
    if (three.some((name) => name === undefined) || new Set(three).size < 3) continue;
    AXES.forEach((letter, i) => {
      found[`${channel}_${letter}`] = /** @type {string} */ (three[i]);
      used.add(three[i]);
    });
  }
  for (const channel of ["time", "pressure"]) {
    const name = columns.find((column) => !used.has(column) && LIKE[channel].test(column));
    if (name !== undefined) {
      found[channel] = name;
      used.add(name);
    }
  }
  return found;
}

/**
 * What a mapping is in the fields of the form.
 * @param {Mapping} mapping
 * @returns {Record<string, string>} field of the form → value
 */
export function fieldsOf(mapping) {
  /** @type {Record<string, string>} */
  const fields = { time: mapping.time.column ?? "", time_unit: mapping.time.unit ?? "s" };
  if (mapping.time.rate_hz) fields.rate_hz = String(mapping.time.rate_hz);
  for (const channel of /** @type {const} */ (["gyr", "acc", "mag"])) {
    const axes = mapping[channel];
    if (!axes) continue;
    AXES.forEach((letter, i) => (fields[`${channel}_${letter}`] = axes.columns[i]));
    fields[`${channel}_unit`] = axes.unit;
    if (axes.one_is) fields[`${channel}_one_is`] = String(axes.one_is);
  }
  if (mapping.pressure) {
    fields.pressure = mapping.pressure.column;
    fields.pressure_unit = mapping.pressure.unit;
  }
  return fields;
}

/**
 * The mapping that a form says, or the words for what it lacks.
 * @param {FormData} data
 * @param {string} delimiter
 * @returns {Mapping}
 */
export function readMapping(data, delimiter) {
  const text = (/** @type {string} */ name) => String(data.get(name) ?? "");
  const axes = (/** @type {string} */ channel) => {
    const columns = AXES.map((axis) => text(`${channel}_${axis}`));
    if (columns.every((column) => column === "")) return null;
    if (columns.some((column) => column === ""))
      throw new Error(t("mapping.incomplete", { channel: t(`channel.${channel}`) }));
    const one_is = Number(text(`${channel}_one_is`).replace(",", "."));
    return {
      columns: /** @type {[string, string, string]} */ (columns),
      unit: text(`${channel}_unit`),
      ...(one_is && one_is !== 1 ? { one_is } : {}),
    };
  };
  const needed = (/** @type {string} */ channel) => {
    const found = axes(channel);
    if (!found) throw new Error(t("mapping.incomplete", { channel: t(`channel.${channel}`) }));
    return found;
  };
  const rate_hz = Number(text("rate_hz"));
  const unit = text("time_unit");
  if ((text("time") === "" || unit === "samples" || unit === "ticks") && !(rate_hz > 0))
    throw new Error(t("mapping.need_rate"));
  const mag = axes("mag");
  return {
    delimiter,
    time: { ...(text("time") ? { column: text("time"), unit } : {}), ...(rate_hz > 0 ? { rate_hz } : {}) },
    gyr: needed("gyr"),
    acc: needed("acc"),
    ...(mag ? { mag } : {}),
    ...(text("pressure") ? { pressure: { column: text("pressure"), unit: text("pressure_unit") } } : {}),
  };
}

/**
 * @param {HTMLElement} box
 * @param {Preview} preview of a table
 * @param {import("./preview.js").NamedMapping[]} presets
 * @param {{use: (mapping: Mapping) => void, saved: () => void}} then
 */
export function mappingForm(box, preview, presets, then) {
  const first = preview.suggestion ? fieldsOf(preview.suggestion) : guess(preview.columns);
  const option = (/** @type {string} */ value, /** @type {string} */ words, /** @type {string | undefined} */ chosen) =>
    html`<option value="${value}" ${value === chosen ? "selected" : ""}>${words}</option>`;
  const column = (/** @type {string} */ name, /** @type {string} */ label) =>
    html`<label class="field"
      ><span>${label}</span
      ><select name="${name}">
        ${option("", t("mapping.not_there"), undefined)}${preview.columns.filter(Boolean).map((c) => option(c, c, first[name]))}
      </select></label
    >`;
  const unit = (/** @type {string} */ channel) =>
    html`<label class="field unit"
      ><span>${t("mapping.unit")}</span
      ><select name="${channel}_unit">
        ${UNITS[channel].map((u) => option(u, tOr(`unit_of.${u}`, u), first[`${channel}_unit`]))}
      </select></label
    >`;
  const oneIs = (/** @type {string} */ channel) =>
    html`<label class="field"
      ><span>${t("mapping.one_is")}</span
      ><input
        name="${channel}_one_is"
        inputmode="decimal"
        autocomplete="off"
        placeholder="1"
        value="${first[`${channel}_one_is`] ?? ""}"
    /></label>`;
  const three = (/** @type {string} */ channel) =>
    html`<fieldset>
      <legend>${t(`channel.${channel}`)}</legend>
      <div class="mapped">
        ${AXES.map((axis) => column(`${channel}_${axis}`, axis))}${unit(channel)}${oneIs(channel)}
      </div>
    </fieldset>`;
  const markup = html`<div class="mapping" data-testid="mapping">
    <p>${t("mapping.lead")}</p>
    ${preview.suggestion && html`<p class="muted" data-testid="suggested">${t("mapping.suggested")}</p>`}
    ${
      presets.length > 0 &&
      html`<label class="field"
        ><span>${t("mapping.preset")}</span
        ><select name="preset">
          <option value="">–</option>
          ${presets.map((p) => option(p.id, p.name, undefined))}
        </select></label
      >`
    }
    <fieldset>
      <legend>${t("channel.time")}</legend>
      <div class="mapped">
        ${column("time", t("mapping.column"))}${unit("time")}
        <label class="field"
          ><span>${t("mapping.rate")}</span
          ><input name="rate_hz" inputmode="decimal" autocomplete="off" value="${first.rate_hz ?? ""}"
        /></label>
      </div>
    </fieldset>
    ${three("gyr")}${three("acc")}${three("mag")}
    <fieldset>
      <legend>${t("channel.pressure")}</legend>
      <div class="mapped">${column("pressure", t("mapping.column"))}${unit("pressure")}</div>
    </fieldset>
    <div class="row">
      <button type="button" class="use" data-testid="use-mapping">${t("mapping.use")}</button>
      <label class="field"
        ><span>${t("mapping.name")}</span><input name="preset_name" autocomplete="off" maxlength="80"
      /></label>
      <button type="button" class="save" data-testid="save-mapping">${t("mapping.save")}</button>
    </div>
    <div class="mapping-answer" aria-live="polite"></div>
  </div>`;
  // It is asked already, and listens.
  if (!render(box, markup)) return;

  /** The fields are part of the page's form: read here one by one. */
  const data = () => {
    const read = new FormData();
    for (const el of box.querySelectorAll("select, input")) {
      const field = /** @type {HTMLInputElement | HTMLSelectElement} */ (el);
      if (field.name) read.set(field.name, field.value);
    }
    return read;
  };
  const answer = one(".mapping-answer", box);
  const tryTo = async (/** @type {() => void | Promise<void>} */ run) => {
    render(answer, html``);
    try {
      await run();
    } catch (error) {
      render(answer, problemBox(error));
    }
  };
  one(".use", box).addEventListener("click", () =>
    tryTo(() => then.use(readMapping(data(), preview.delimiter ?? "comma"))),
  );
  one(".save", box).addEventListener("click", () =>
    tryTo(async () => {
      const mapping = readMapping(data(), preview.delimiter ?? "comma");
      const name = String(data().get("preset_name") ?? "").trim();
      if (name === "") throw new Error(t("mapping.need_name"));
      await api.saveMapping(name, mapping);
      then.saved();
      then.use(mapping);
    }),
  );
  box.querySelector("[name=preset]")?.addEventListener("change", (event) => {
    const id = /** @type {HTMLSelectElement} */ (event.target).value;
    const preset = presets.find((p) => p.id === id);
    if (preset) then.use(preset.mapping);
  });
}
