// A log before it is handed in, as a card: what it is, what it is worth, what should be looked at.

import { duration, number } from "../format.js";
import { html } from "../html.js";
import { t, tOr } from "../i18n.js";
import { STAND_S, warnings } from "./preview.js";

/** @typedef {import("./preview.js").Preview} Preview */

const CHART = { width: 240, height: 44 };
const ROW_NAMES = ["t_s", "gyr_x", "gyr_y", "gyr_z", "acc_x", "acc_y", "acc_z", "mag_x", "mag_y", "mag_z", "hPa"];

/**
 * @param {Preview} preview
 * @param {string} stream in words: names the regions that scroll
 * @param {boolean} aligned whether the system is aligned by a stand
 */
export function previewCard(preview, stream, aligned) {
  const { survey } = preview;
  const some = survey.samples > 0;
  return html`<p class="format">
      <b data-testid="format">${formatName(preview)}</b
      >${preview.part && html` <span class="muted">${t("upload.preview.part")}</span>`}
    </p>
    ${preview.problem && html`<div class="problem" role="alert" data-testid="preview-problem"><p>${preview.problem.detail}</p></div>`}
    ${
      some &&
      html`<dl class="facts">
          ${fact("rate", survey.rate_hz === null ? "–" : `${number(survey.rate_hz, survey.rate_hz < 99 ? 1 : 0)} Hz`)}
          ${fact("duration", duration(survey.duration_s))}
          ${fact("gaps", survey.gaps === 0 ? t("upload.preview.none") : `${survey.gaps} · ${number(survey.gaps_s, 2)} s`)}
          ${fact("clipped", survey.clipped_rates + survey.clipped_forces === 0 ? t("upload.preview.none") : String(survey.clipped_rates + survey.clipped_forces))}
          ${fact("still", `${number(survey.still_s, 1)} s${aligned ? (survey.still_s >= STAND_S ? " ✓" : " !") : ""}`)}
          ${fact("field", field(preview))}
          ${fact("pressure", survey.pressure_share > 0 ? t("upload.preview.yes") : t("upload.preview.no"))}
          ${fact("samples", survey.samples.toLocaleString("en"))}
        </dl>
        ${chart("rate", survey.chart.rate_rad_s, "rad/s")}${chart("force", survey.chart.force_m_s2, "m/s²")}
        <ul class="warnings">
          ${warnings(preview, aligned).map(({ key, values }) => html`<li data-warning="${key}">${t(`upload.preview.warn.${key}`, values)}</li>`)}
        </ul>`
    }
    ${
      preview.mapping &&
      html`<details>
        <summary>${t("upload.preview.mapping")}</summary>
        ${mappingList(preview.mapping)}
      </details>`
    }
    ${
      (some || preview.rows.length > 0) &&
      html`<details>
        <summary>${t("upload.preview.rows")}</summary>
        <div class="scrolls" tabindex="0" role="region" aria-label="${t("upload.preview.rows")} · ${stream}">
          ${some ? samples(preview) : text(preview)}
        </div>
      </details>`
    }`;
}

/**
 * What is no table at all is read as the canonical log, whose reader says what it misses; it is none.
 * @param {Preview} preview
 */
function formatName(preview) {
  const none =
    preview.format === null ||
    (preview.format === "canonical" && preview.columns.length === 0 && preview.survey.samples === 0);
  return none ? t("format.unknown") : tOr(`format.${preview.format}`, String(preview.format));
}

/** @param {Preview} preview */
function field({ survey, field_in_counts }) {
  if (survey.field_mean_ut === null) return t("upload.preview.no");
  return field_in_counts
    ? t("upload.preview.counts", { counts: number(survey.field_mean_ut, 1) })
    : `${number(survey.field_mean_ut, 1)} µT`;
}

/**
 * @param {string} key
 * @param {string} value
 */
function fact(key, value) {
  return html`<div>
    <dt>${t(`upload.preview.${key}`)}</dt>
    <dd data-fact="${key}">${value}</dd>
  </div>`;
}

/** @param {import("./preview.js").Mapping} mapping */
function mappingList(mapping) {
  const line = (
    /** @type {string} */ channel,
    /** @type {string[]} */ columns,
    /** @type {string | undefined} */ unit,
  ) =>
    html`<div>
      <dt>${t(`channel.${channel}`)}</dt>
      <dd>${columns.join(", ")}${unit && html` <span class="muted">${tOr(`unit_of.${unit}`, unit)}</span>`}</dd>
    </div>`;
  const { time } = mapping;
  return html`<dl class="facts wide">
    ${line("time", [time.column ?? t("upload.preview.by_rate")], time.rate_hz ? `${time.rate_hz} Hz` : time.unit)}
    ${line("gyr", mapping.gyr.columns, mapping.gyr.unit)}${line("acc", mapping.acc.columns, mapping.acc.unit)}
    ${mapping.mag && line("mag", mapping.mag.columns, mapping.mag.unit)}
    ${mapping.pressure && line("pressure", [mapping.pressure.column], mapping.pressure.unit)}
  </dl>`;
}

/** @param {Preview} preview */
function samples({ survey }) {
  return html`<table>
    <thead>
      <tr>
        ${ROW_NAMES.map((name) => html`<th scope="col">${name}</th>`)}
      </tr>
    </thead>
    <tbody>
      ${survey.first_rows.map(
        (row) =>
          html`<tr>
            ${row.map((value, i) => html`<td>${number(value, i === 0 ? 4 : 3)}</td>`)}
          </tr>`,
      )}
    </tbody>
  </table>`;
}

/** @param {Preview} preview */
function text({ columns, rows }) {
  return html`<table>
    <thead>
      <tr>
        ${columns.map((name) => html`<th scope="col">${name || "–"}</th>`)}
      </tr>
    </thead>
    <tbody>
      ${rows.map(
        (row) =>
          html`<tr>
            ${columns.map((_, i) => html`<td>${row[i] ?? ""}</td>`)}
          </tr>`,
      )}
    </tbody>
  </table>`;
}

/**
 * The band between least and most, as one shape.
 * @param {string} key
 * @param {([number, number] | null)[]} bins
 * @param {string} unit
 */
function chart(key, bins, unit) {
  const known = bins.filter((bin) => bin !== null);
  if (known.length < 2) return null;
  const top = Math.max(...known.map((bin) => bin[1])) || 1;
  const x = (/** @type {number} */ i) => ((i / (bins.length - 1)) * CHART.width).toFixed(1);
  const y = (/** @type {number} */ value) => (CHART.height - 1 - (value / top) * (CHART.height - 3)).toFixed(1);
  /** @type {string[]} */
  const upper = [];
  /** @type {string[]} */
  const lower = [];
  bins.forEach((bin, i) => {
    if (bin === null) return;
    upper.push(`${x(i)},${y(bin[1])}`);
    lower.unshift(`${x(i)},${y(bin[0])}`);
  });
  return html`<figure class="band">
    <svg
      viewBox="0 0 ${CHART.width} ${CHART.height}"
      preserveAspectRatio="none"
      role="img"
      aria-label="${t(`upload.preview.chart.${key}`)}"
    >
      <polygon points="${[...upper, ...lower].join(" ")}" />
    </svg>
    <figcaption class="muted">${t(`upload.preview.chart.${key}`)} · ≤ ${number(top, 1)} ${unit}</figcaption>
  </figure>`;
}
