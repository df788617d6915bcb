// The dock in the evening: walks that were opened at a kiosk and wait for their logs, and logs that are here already.

import { dateTime } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { sha256OfFile } from "./sha256.js";

/** @typedef {{id: string, inspector_id: string, inspector: string, title: string, system: string, started_at: string, keyed: number, faults: number, fits: boolean, start: {marker: string | null}}} WaitingWalk */
/** @typedef {{session: {id: string, title: string, started_at: string}, inspector: string, stream: string}} KnownLog */

/** @param {WaitingWalk[]} walks the likeliest first */
export function waitingList(walks) {
  if (walks.length === 0) return html``;
  return html`<div class="block" data-testid="waiting">
    <h2>${t("upload.waiting")}</h2>
    <p class="muted">${t("upload.waiting_hint")}</p>
    <div class="cards">
      ${walks.map(
        (walk) =>
          html`<button type="button" class="card" data-waiting="${walk.id}">
            <span class="line"
              ><b class="grow"><bdi>${walk.inspector}</bdi></b
              ><span>${dateTime(walk.started_at)}</span></span
            >
            <span class="sub"
              >${walk.title && html`<bdi>${walk.title}</bdi> · `}${walk.start.marker && html`${walk.start.marker} · `}${t("upload.waiting_has", { markers: walk.keyed, faults: walk.faults })}${!walk.fits && html` · <span class="warning">${t("upload.too_short")}</span>`}</span
            >
          </button>`,
      )}
    </div>
  </div>`;
}

/**
 * What is remembered of a walk that was chosen, until its logs are in. It stays when the upload is given up.
 * @param {WaitingWalk} walk
 * @returns {import("./remembered_upload.js").Unfinished}
 */
export const chosen = ({ id, system, title, inspector, started_at }) => ({
  session_id: id,
  system,
  title,
  logs: {},
  waits: true,
  who: inspector,
  started_at,
});

/** @param {import("./remembered_upload.js").Unfinished} left */
export const whose = ({ who, started_at, title }) =>
  [who, started_at && `${dateTime(started_at)}`, title].filter(Boolean).join(" · ");

/**
 * What the previews say of the log: when it began, where its clock is one of the day, and how long it is.
 * @param {import("./preview.js").Preview[]} previews
 */
export function logQuery(previews) {
  const query = new URLSearchParams();
  const spans = previews.flatMap(({ clock_ns }) => (clock_ns ? [clock_ns] : []));
  if (spans.length === 0) return query;
  const first_ns = Math.min(...spans.map(([first]) => first));
  const last_ns = Math.max(...spans.map(([, last]) => last));
  query.set("duration_s", String((last_ns - first_ns) / 1e9));
  // A clock that counts from its own start says nothing of the day.
  if (first_ns > EPOCH_2000_NS) query.set("began_at", new Date(first_ns / 1e6).toISOString());
  return query;
}

const EPOCH_2000_NS = 946_684_800e9;

/**
 * Walks that hold one of these files already.
 * @param {{knownLogs: (sha256: string) => Promise<KnownLog[]>}} api
 * @param {File[]} files
 * @param {string | undefined} but the walk for which they are handed in
 */
export async function knownWalks(api, files, but) {
  const found = new Map();
  for (const file of files)
    for (const known of await api.knownLogs(await sha256OfFile(file)))
      if (known.session.id !== but) found.set(known.session.id, { ...known, file: file.name });
  return [...found.values()];
}

/** @param {(KnownLog & {file: string})[]} known */
export function alreadyHere(known) {
  return html`<div class="problem" role="alert" data-testid="already-here">
    <b>${t("upload.already_here")}</b>
    ${known.map(
      ({ session, inspector, file }) =>
        html`<p>
          ${file}:
          <a href="#/sessions/${encodeURIComponent(session.id)}"
            ><bdi>${inspector}</bdi> ·
            ${dateTime(session.started_at)}${session.title && html` · <bdi>${session.title}</bdi>`}</a
          >
        </p>`,
    )}
    <button type="button" class="anyway">${t("upload.anyway")}</button>
  </div>`;
}
