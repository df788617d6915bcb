// What is known about a marker: what the walks found at it, and what it was before.

import { dateTime, number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { sourceOf } from "./source.js";

/** @typedef {{e_m: number, n_m: number, u_m: number | null}} Place */
/**
 * @typedef {{
 *   marker: string, revision: number, changed_at: string, changed_by: string | null, reason: string, import_id: string | null, is_revert: boolean,
 *   before: Place | null, after: Place | null,
 * }} MarkerChange
 * @typedef {{session_id: string, t_applied_ns: number, visited_at: string, accepted: boolean, nis: number, residual_m: number[]}} VisitResidual
 */

/** @param {import("./view.js").MarkerResiduals | null} found */
export function residualFigures(found) {
  if (!found) return html`<p class="muted">${t("markers.no_visits")}</p>`;
  return html` <p>
      ${found.suspect ? html`<span class="tag bad">${t("markers.suspect_survey")}</span>` : found.p_value === null ? html`<span class="tag">${t("markers.too_few")}</span>` : html`<span class="tag good">${t("markers.not_suspect")}</span>`}
    </p>
    <dl class="facts">
      <dt>${t("markers.visits")}</dt>
      <dd>${t("markers.visits_of", { visits: found.visits, sessions: found.sessions, rejected: found.rejected })}</dd>
      <dt>${t("markers.mean_off")}</dt>
      <dd>
        ${number(found.mean_length_m, 2)} m · ${String(Math.round(found.mean_direction_deg) % 360).padStart(3, "0")}°
      </dd>
      <dt>${t("markers.rms")}</dt>
      <dd>${number(found.rms_m, 2)} m</dd>
      <dt>${t("markers.largest")}</dt>
      <dd>${number(found.largest_m, 2)} m</dd>
      ${
        found.p_value !== null &&
        html`<dt>${t("markers.chance")}</dt>
          <dd>${found.p_value < 0.001 ? "< 0.1 %" : `${number(100 * found.p_value, 1)} %`}</dd>`
      }
    </dl>`;
}

/** @param {VisitResidual[]} visits */
export function residualTable(visits) {
  if (visits.length === 0) return html``;
  return html`<table>
    <thead>
      <tr>
        <th>${t("markers.visited")}</th>
        <th class="num">${t("axis.east_m")}</th>
        <th class="num">${t("axis.north_m")}</th>
      </tr>
    </thead>
    <tbody>
      ${visits
        .slice(-12)
        .reverse()
        .map(
          (visit) =>
            html`<tr>
              <td>
                <a href="#/sessions/${encodeURIComponent(visit.session_id)}">${dateTime(visit.visited_at)}</a
                >${!visit.accepted && html` <span class="tag warn">${t("visit.rejected")}</span>`}
              </td>
              <td class="num">${number(visit.residual_m[0], 2)}</td>
              <td class="num">${number(visit.residual_m[1], 2)}</td>
            </tr>`,
        )}
    </tbody>
  </table>`;
}

/**
 * @param {MarkerChange[]} changes
 * @param {import("./files.js").Import[]} files those that were taken in, as far as they are known
 */
export function historyList(changes, files) {
  /** @param {MarkerChange} change */
  const source = ({ import_id, is_revert }) => {
    if (!import_id) return null;
    if (is_revert) return t("markers.by_revert");
    return sourceOf(files.find(({ id }) => id === import_id)?.file_name) ?? t("markers.by_file");
  };
  if (changes.length === 0) return html`<p class="muted">${t("markers.no_history")}</p>`;
  return html`<ol class="changes-list">
    ${changes.map(
      (change) =>
        html`<li>
          <span class="line"
            ><b class="grow">${whatChanged(change)}</b><span class="muted">${dateTime(change.changed_at)}</span></span
          >
          <span class="sub"
            >${[change.changed_by, source(change), change.reason].filter(Boolean).map((part, i) => html`${i > 0 && " · "}${part}`)}</span
          >
        </li>`,
    )}
  </ol>`;
}

/** @param {MarkerChange} change */
function whatChanged({ before, after }) {
  if (!before) return t("markers.was_added");
  if (!after) return t("markers.was_removed");
  const moved = Math.hypot(after.e_m - before.e_m, after.n_m - before.n_m);
  const raised = after.u_m !== null && before.u_m !== null ? after.u_m - before.u_m : 0;
  return (
    [
      moved > 0 && t("markers.moved_by", { metres: number(moved, 3) }),
      raised !== 0 && t("markers.raised_by", { metres: number(raised, 3) }),
    ]
      .filter(Boolean)
      .join(", ") || t("markers.height_changed")
  );
}
