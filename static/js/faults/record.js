// What happened to a fault, and its photos.

import { photoUrl } from "../api.js";
import { bytes, dateTime } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { faultKind } from "./cards.js";

/**
 * @typedef {{
 *   changed_at: string, changed_by: string | null, what: "state" | "assignee" | "severity" | "kind" | "text" | "marker" | "photo" | "comment" | "place",
 *   before: string | null, after: string | null, comment: string,
 * }} FaultChange
 * @typedef {{id: string, content_type: string, size_bytes: number, created_at: string, created_by: string | null}} Photo
 */

/**
 * @param {import("../state/live.js").Fault} fault
 * @param {FaultChange[]} changes oldest first
 * @param {(id: string | null | undefined) => string} nameOf
 */
export function faultHistory(fault, changes, nameOf) {
  return html`<ol class="changes-list">
    ${[...changes].reverse().map(
      (change) =>
        html`<li>
          <span class="line"
            ><span class="grow">${words(change, nameOf)}</span
            ><span class="muted">${dateTime(change.changed_at)}</span></span
          >
          <span class="sub">${[change.changed_by, change.comment].filter(Boolean).join(" · ")}</span>
        </li>`,
    )}
    <li>
      <span class="line"
        ><span class="grow">${t("fault.was_reported")}</span
        ><span class="muted">${dateTime(fault.reported_at)}</span></span
      ><span class="sub">${nameOf(fault.inspector_id)}</span>
    </li>
  </ol>`;
}

/**
 * @param {FaultChange} change
 * @param {(id: string | null | undefined) => string} nameOf
 */
function words({ what, before, after }, nameOf) {
  switch (what) {
    case "state":
      return html`<b>${t(`fault.state.${after}`)}</b>`;
    case "assignee":
      return after ? t("fault.was_assigned", { name: nameOf(after) }) : t("fault.was_unassigned");
    case "severity":
      return `${t("fault.severity")}: ${t(`severity.${before}`)} → ${t(`severity.${after}`)}`;
    case "kind":
      return `${t("fault.kind")}: ${faultKind(before ?? "")} → ${faultKind(after ?? "")}`;
    case "marker":
      return `${t("fault.actuator")}: ${before ?? "–"} → ${after ?? "–"}`;
    case "text":
      return t("fault.was_reworded");
    case "place":
      return `${t("fault.placed")}: ${before ?? t("fault.to_be_placed")} → ${after ?? "–"}`;
    case "photo":
      return t(after ? "fault.photo_added" : "fault.photo_removed");
    default:
      return t("fault.commented");
  }
}

/**
 * @param {string} faultId
 * @param {Photo[]} photos
 * @param {boolean} writes whether they may be removed
 */
export function photoGrid(faultId, photos, writes) {
  if (photos.length === 0) return html`<p class="muted">${t("fault.no_photos")}</p>`;
  return html`<ul class="photos">
    ${photos.map(
      (photo) =>
        html`<li>
          <a href="${photoUrl(faultId, photo.id)}" target="_blank" rel="noopener"
            ><img
              src="${photoUrl(faultId, photo.id)}"
              alt="${t("fault.photo_of", { time: dateTime(photo.created_at) })}"
              loading="lazy"
              data-testid="photo-shown"
          /></a>
          <span class="muted">${bytes(photo.size_bytes)}</span>
          ${writes && html`<button type="button" class="quiet" data-remove-photo="${photo.id}">${t("fault.remove_photo")}</button>`}
        </li>`,
    )}
  </ul>`;
}
