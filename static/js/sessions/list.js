// Walks: looked for by who, when, how they came and how they went. What is looked for stands in the address.

import * as api from "../api.js";
import { bytes, dateTime, duration, length } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { t, translate } from "../i18n.js";
import { fetchScreen } from "./open.js";
import { problemBox } from "../ui/problem.js";
import { FLAGS, MODES, PAGE, SORTS, readSearch, toQuery, writeSearch } from "./search.js";

/** @type {Record<string, string>} */
const TONES = { finished: "good", failed: "bad", processing: "warn", live: "good", receiving: "warn" };
const STATES = ["created", "receiving", "live", "processing", "finished", "failed"];
/** The columns of the exported list. */
const EXPORTED = /** @type {const} */ ([
  "id",
  "inspector",
  "title",
  "state",
  "started_at",
  "ended_at",
  "distance_m",
  "duration_s",
  "closure_m",
  "rejected_visits",
  "anomalies",
  "gaps",
  "excluded",
  "starred",
  "note",
]);
/** What is typed is looked for when the typing rests, ms. */
const REST_MS = 200;

/** @param {string} state */
export const stateTag = (state) => html`<span class="tag ${TONES[state] ?? ""}">${t(`session.state.${state}`)}</span>`;

/** @type {import("../ui/router.js").MakeView} */
export function sessionsView(app, side) {
  const wanted = readSearch(location.hash);
  const option = (/** @type {string} */ value, /** @type {string} */ words, /** @type {string} */ chosen) =>
    html`<option value="${value}" ${value === chosen && "selected"}>${words}</option>`;
  render(
    side,
    html` <div class="side-head">
        <h1 data-t="nav.sessions"></h1>
        <form class="session-filter">
          <input
            type="search"
            name="text"
            data-t-hint="sessions.search"
            data-t-label="sessions.search"
            autocomplete="off"
            value="${wanted.text}"
          />
          <details ${writeSearch({ ...wanted, text: "", page: 0 }) !== "#/sessions" && "open"}>
            <summary data-t="sessions.filter"></summary>
            <div class="two">
              <label class="field"
                ><span data-t="sessions.inspector"></span
                ><select name="inspector_id">
                  ${option("", "–", wanted.inspector_id)}${[...app.live.inspectors.values()].map((i) => option(i.id, i.name, wanted.inspector_id))}
                </select></label
              >
              <label class="field"
                ><span data-t="sessions.state"></span
                ><select name="state">
                  ${option("", "–", wanted.state)}${STATES.map((state) => option(state, t(`session.state.${state}`), wanted.state))}
                </select></label
              >
              <label class="field"
                ><span data-t="sessions.from"></span><input type="date" name="from" value="${wanted.from}"
              /></label>
              <label class="field"
                ><span data-t="sessions.to"></span><input type="date" name="to" value="${wanted.to}"
              /></label>
              <label class="field"
                ><span data-t="sessions.mode"></span
                ><select name="mode">
                  ${option("", "–", wanted.mode)}${MODES.map((mode) => option(mode, t(`sessions.mode.${mode}`), wanted.mode))}
                </select></label
              >
              <label class="field"
                ><span data-t="sessions.sort"></span
                ><select name="sort">
                  ${SORTS.flatMap((sort) => [option(sort, t(`sessions.sort.${sort}`), wanted.sort), option(`-${sort}`, `${t(`sessions.sort.${sort}`)} ↑`, wanted.sort)])}
                </select></label
              >
            </div>
            <fieldset>
              <legend data-t="sessions.flags"></legend>
              <div class="choices">
                ${FLAGS.map((flag) => html`<label><input type="checkbox" name="flags" value="${flag}" ${wanted.flags.includes(flag) && "checked"} /><span>${t(`sessions.flag.${flag}`)}</span></label>`)}
              </div>
            </fieldset>
            <button type="button" data-clear data-t="sessions.clear"></button>
            <button type="button" data-export data-testid="export-sessions" data-t="list.export"></button>
          </details>
        </form>
        <p class="summary" aria-live="polite"></p>
      </div>
      <div class="rows" data-testid="sessions"><p class="empty" data-t="loading"></p></div>
      <nav class="row pages" data-t-label="sessions.pages" hidden>
        <button type="button" data-page="-1" data-t="sessions.before"></button><span class="grow muted"></span
        ><button type="button" data-page="1" data-t="sessions.next"></button>
      </nav>`,
  );
  translate(side);
  const form = /** @type {HTMLFormElement} */ (one("form", side));
  let gone = false;
  let asked = 0;
  let timer = 0;
  let total = 0;

  async function fetchPage() {
    const now = (asked += 1);
    try {
      const found = await api.searchSessions(toQuery(wanted));
      if (gone || now !== asked) return;
      total = found.total;
      show(found);
    } catch (error) {
      if (!gone && now === asked) render(one(".rows", side), problemBox(error));
    }
  }

  /** @param {import("./search.js").Page} found */
  function show(found) {
    setText(one(".summary", side), t("sessions.summary", { n: found.total, size: bytes(found.stored_bytes) }));
    render(
      one(".rows", side),
      found.sessions.length === 0
        ? html`<p class="empty">${t("sessions.none")} <a href="#/upload">${t("nav.upload")}</a></p>`
        : html`${found.sessions.map(
            (s) =>
              html`<a
                class="card"
                href="#/sessions/${encodeURIComponent(s.id)}"
                data-testid="session-card"
                data-state="${s.state}"
              >
                <span class="line"
                  ><b class="grow"
                    >${s.starred && html`<span class="star" role="img" aria-label="${t("sessions.flag.starred")}">★</span> `}${s.title || s.inspector}</b
                  >${stateTag(s.state)}</span
                >
                <span class="sub"
                  >${s.title && html`<bdi>${s.inspector}</bdi> · `}${dateTime(s.started_at)} · ${length(s.distance_m)} ·
                  ${duration(s.duration_s)}${s.stored_bytes > 0 && html` · ${bytes(s.stored_bytes)}`}</span
                >
                ${flagsOf(s)}${s.note && html`<span class="sub note">${s.note}</span>`}</a
              >`,
          )}`,
    );
    const pages = one(".pages", side);
    pages.hidden = found.total <= PAGE;
    const last = Math.max(1, Math.ceil(found.total / PAGE));
    setText(one("span", pages), t("sessions.page", { page: wanted.page + 1, last }));
    /** @type {HTMLButtonElement} */ (one("[data-page='-1']", pages)).disabled = wanted.page === 0;
    /** @type {HTMLButtonElement} */ (one("[data-page='1']", pages)).disabled = wanted.page + 1 >= last;
  }

  function changed() {
    history.replaceState(null, "", writeSearch(wanted));
    clearTimeout(timer);
    timer = window.setTimeout(fetchPage, REST_MS);
  }

  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("input", () => {
    const data = new FormData(form);
    for (const name of /** @type {const} */ (["text", "inspector_id", "state", "from", "to", "mode", "sort"]))
      wanted[name] = String(data.get(name) ?? "");
    wanted.flags = data.getAll("flags").map(String);
    wanted.page = 0;
    changed();
  });
  one("[data-clear]", side).addEventListener("click", () => {
    for (const field of form.querySelectorAll("input, select")) {
      const input = /** @type {HTMLInputElement} */ (field);
      if (input.type === "checkbox") input.checked = false;
      else input.value = input.name === "sort" ? SORTS[0] : "";
    }
    form.dispatchEvent(new Event("input"));
  });
  one("[data-export]", side).addEventListener("click", async () => {
    try {
      const rows = [];
      for (let page = 0; ; page += 1) {
        const query = toQuery({ ...wanted, page });
        const found = await api.searchSessions(query);
        rows.push(...found.sessions);
        if (found.sessions.length === 0 || rows.length >= found.total) break;
      }
      const { csv, download } = await import("../ui/csv.js");
      download("walks.csv", csv(EXPORTED, /** @type {any[]} */ (rows)));
    } catch (error) {
      render(one(".rows", side), problemBox(error));
    }
  });
  one(".pages", side).addEventListener("click", (event) => {
    const by = Number(/** @type {HTMLElement} */ (event.target).getAttribute("data-page"));
    if (!by) return;
    wanted.page = Math.min(Math.max(0, wanted.page + by), Math.ceil(total / PAGE) - 1);
    side.scrollTop = 0;
    changed();
  });

  fetchPage();
  // Most who look at the list open a walk.
  fetchScreen().catch(() => {});
  return {
    update(topics) {
      if (topics.has("session") || topics.has("job") || topics.has("all")) changedElsewhere();
    },
    close() {
      gone = true;
      clearTimeout(timer);
    },
  };

  /** Many changes at once are one look. */
  function changedElsewhere() {
    clearTimeout(timer);
    timer = window.setTimeout(fetchPage, REST_MS);
  }
}

/** @param {import("./search.js").Found} s */
function flagsOf(s) {
  const flags = [
    s.closure_is_large && t("sessions.has.closure", { m: length(s.closure_m) }),
    s.rejected_visits > 0 && t("sessions.has.rejected", { n: s.rejected_visits }),
    s.gaps > 0 && t("sessions.has.gap", { n: s.gaps }),
    s.anomalies > s.gaps && t("sessions.has.anomalies", { n: s.anomalies - s.gaps }),
  ].filter(Boolean);
  return (
    flags.length > 0 &&
    html`<span class="sub flags">${flags.map((words) => html`<span class="tag warn">${words}</span>`)}</span>`
  );
}
