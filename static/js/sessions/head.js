// Who walked when, how far and how long.

import { dateTime, elapsed, length, number } from "../format.js";
import { html, render } from "../html.js";
import { t } from "../i18n.js";
import { offBefore } from "../state/findings.js";
import { keyOf } from "../systems/index.js";
import { figure } from "./figures.js";
import { stateTag } from "./list.js";

/**
 * @param {HTMLElement} el
 * @param {any} row the session
 * @param {string} name the inspector's
 * @param {import("../state/findings.js").Visit[]} visits
 * @param {import("../systems/index.js").System} system
 */
export function showHead(el, row, name, visits, system) {
  // One that places itself is not corrected by visits, but held against them.
  const held = system.placesItself;
  const used = visits.filter((v) => v.accepted || (held && offBefore(v) !== null));
  const key = (/** @type {string} */ word) => keyOf(system, `session.${word}`);
  const metres = (/** @type {number} */ m) => (held ? `${number(m, 3)} m` : length(m));
  const offs = used.map((v) => offBefore(v) ?? 0);
  render(
    el,
    html` <h1>${row.title || name}</h1>
      <p class="muted">
        ${row.title && html`<bdi>${name}</bdi> · `}${dateTime(row.started_at)} ${t("zone")} ${stateTag(row.state)}
      </p>
      ${
        row.error &&
        html`<div class="problem">
          <b>${t("problem.failed")}</b>
          <p>${typeof row.error === "string" ? row.error : (row.error.detail ?? row.error.title)}</p>
        </div>`
      }
      <div class="figures" data-testid="figures">
        ${figure(length(row.distance_m), "session.distance")} ${figure(elapsed(row.duration_s), "session.duration")}
        ${figure(held ? String(used.length) : `${used.length} / ${visits.length}`, key("visits_used"))}
        ${figure(offs.length > 0 ? metres(offs.reduce((a, b) => a + b, 0) / offs.length) : "–", key("mean_off"))}
        ${figure(offs.length > 0 ? metres(Math.max(...offs)) : "–", key("largest_off"))}
        ${figure(row.samples ? Number(row.samples).toLocaleString("en") : "–", "session.samples")}
      </div>`,
  );
}
