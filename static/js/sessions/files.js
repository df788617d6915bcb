// The files of a walk: its track to take along, and the logs that it was made of.

import { trackFile } from "../api.js";
import { bytes } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { streamOf } from "../systems/index.js";

const EXPORTS = ["csv", "geojson", "gpx", "kml"];

/**
 * @param {import("../systems/index.js").System} system
 * @param {any} row the session
 */
export function fileList(system, row) {
  return html`<h2>${t("session.exports")}</h2>
    <p class="row">
      ${EXPORTS.map((f) => html`<a href="${trackFile(row.id, f)}" download>${f === "csv" ? "CSV" : f === "geojson" ? "GeoJSON" : f.toUpperCase()}</a>`)}
    </p>
    ${
      row.logs?.length > 0 &&
      html`<h3>${t("session.logs")}</h3>
        ${row.logs.map((/** @type {any} */ l) => html`<p>${streamOf(system, l) ?? "–"}: ${l.file_name ?? "–"} · ${l.size_bytes ? bytes(l.size_bytes) : "–"} · ${Number(l.samples ?? 0).toLocaleString("en")} ${t("session.samples")}</p>`)}`
    }
    ${row.track_sha256 && html`<p class="mono muted" title="${t("session.digest")}">${t("session.digest")}: ${row.track_sha256}</p>`}`;
}
