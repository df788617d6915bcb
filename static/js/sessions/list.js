// All walks, newest first. A click draws one.

import { sessions as fetchSessions } from "../api.js";
import { dateTime, duration, length } from "../format.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { fetchScreen } from "./open.js";
import { problemBox } from "../ui/problem.js";

/** @type {Record<string, string>} */
const TONES = { finished: "good", failed: "bad", processing: "warn", live: "good", receiving: "warn" };

/** @param {string} state */
export const stateTag = (state) => html`<span class="tag ${TONES[state] ?? ""}">${t(`session.state.${state}`)}</span>`;

/** @type {import("../ui/router.js").MakeView} */
export function sessionsView(app, side) {
  render(side, html`
    <div class="side-head"><h1 data-t="nav.sessions"></h1>
      <input type="search" data-t-hint="sessions.search" data-t-label="sessions.search" autocomplete="off"></div>
    <div class="rows" data-testid="sessions"><p class="empty" data-t="loading"></p></div>`);
  translate(side);
  /** @type {any[] | null} */
  let list = null;
  let gone = false;
  const search = /** @type {HTMLInputElement} */ (one("input", side));
  search.addEventListener("input", show);

  async function fetchList() {
    try {
      const found = await fetchSessions();
      if (gone) return;
      list = found.sort((a, b) => String(b.started_at ?? "").localeCompare(String(a.started_at ?? "")));
      show();
    } catch (error) {
      if (!gone) render(one(".rows", side), problemBox(error));
    }
  }

  function show() {
    if (!list) return;
    const wanted = search.value.trim().toLowerCase();
    const rows = list
      .map((s) => ({ ...s, name: app.live.inspectors.get(s.inspector_id)?.name ?? "–" }))
      .filter((s) => `${s.name} ${s.title ?? ""}`.toLowerCase().includes(wanted));
    render(one(".rows", side), rows.length === 0
      ? html`<p class="empty">${t("sessions.none")} <a href="#/upload">${t("nav.upload")}</a></p>`
      : html`${rows.map((s) => html`<a class="card" href="#/sessions/${encodeURIComponent(s.id)}" data-testid="session-card" data-state="${s.state}">
          <span class="line"><b class="grow">${s.title || s.name}</b>${stateTag(s.state)}</span>
          <span class="sub">${s.title && html`<bdi>${s.name}</bdi> · `}${dateTime(s.started_at)} · ${length(s.distance_m)} · ${duration(s.duration_s)}</span></a>`)}`);
  }

  fetchList();
  // Most who look at the list open a walk.
  fetchScreen().catch(() => {});
  return {
    update(changed) {
      if (changed.has("session") || changed.has("job")) fetchList();
      else if (changed.has("all")) show();
    },
    close() {
      gone = true;
    },
  };
}
