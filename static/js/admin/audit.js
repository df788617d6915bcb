// Who changed what, when, from what to what: the newest first, narrowed by words, taken out as CSV.

import * as api from "../api.js";
import { clock, dateTime } from "../format.js";
import { html, one, render } from "../html.js";
import { t, tOr } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/** Entries that are fetched at once. */
const AT_ONCE = 100;
/** What only says when and by whom is in the entry's own columns. */
const DULL = new Set(["updated_at", "created_at"]);

/**
 * @param {import("../app.js").App} _app
 * @param {HTMLElement} box
 */
export function showAudit(_app, box) {
  render(
    box,
    html`<h2>${t("admin.audit")}</h2>
      <form class="row">
        <input
          name="who"
          class="grow"
          placeholder="${t("admin.audit.who")}"
          aria-label="${t("admin.audit.who")}"
        /><input
          name="action"
          class="grow"
          placeholder="${t("admin.audit.action")}"
          aria-label="${t("admin.audit.action")}"
        />
        <input
          name="subject"
          class="grow"
          placeholder="${t("admin.audit.subject")}"
          aria-label="${t("admin.audit.subject")}"
        /><a class="file" download>${t("admin.audit.export")}</a>
      </form>
      <div class="scroll" tabindex="0" role="region" aria-label="${t("admin.audit")}">
        <table data-testid="audit">
          <thead>
            <tr>
              <th>${t("admin.audit.when")}</th>
              <th>${t("admin.audit.who")}</th>
              <th>${t("admin.audit.action")}</th>
              <th>${t("admin.audit.change")}</th>
            </tr>
          </thead>
          <tbody></tbody>
        </table>
      </div>
      <div class="row end"><button type="button" class="more" hidden>${t("admin.audit.more")}</button></div>`,
  );
  const form = /** @type {HTMLFormElement} */ (one("form", box));
  const more = one(".more", box);
  /** @type {api.AuditEntry[]} */
  let entries = [];

  function query() {
    const wanted = new URLSearchParams();
    for (const [name, value] of new FormData(form)) if (String(value).trim()) wanted.set(name, String(value).trim());
    return wanted;
  }

  async function show(further = false) {
    const wanted = query();
    one("a.file", box).setAttribute("href", api.auditFile(wanted));
    wanted.set("limit", String(AT_ONCE));
    if (further && entries.length > 0) wanted.set("before_id", String(entries[entries.length - 1].id));
    try {
      const found = await api.audit(wanted);
      entries = further ? [...entries, ...found] : found;
      more.hidden = found.length < AT_ONCE;
      render(
        one("tbody", box),
        entries.length === 0
          ? html`<tr>
              <td colspan="4" class="muted">${t("admin.audit.none")}</td>
            </tr>`
          : html`${entries.map(
              (e) =>
                html`<tr>
                  <td>${dateTime(e.at)}:${clock(e.at).slice(6)}</td>
                  <td>${e.who}<br /><span class="muted">${e.address}</span></td>
                  <td>${tOr(`admin.audit.did.${e.action}`, e.action)}<br />${subjectOf(e)}</td>
                  <td class="mono">${difference(e.before, e.after)}</td>
                </tr>`,
            )}`,
      );
    } catch (error) {
      render(
        one("tbody", box),
        html`<tr>
          <td colspan="4">${problemBox(error)}</td>
        </tr>`,
      );
    }
  }

  let timer = 0;
  form.addEventListener("input", () => {
    clearTimeout(timer);
    timer = window.setTimeout(show, 250);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  more.addEventListener("click", () => show(true));
  show();
}

/** Where what was done something to can be looked at, by what its actions begin with. @type {Record<string, (id: string) => string>} */
const PLACES = {
  session: (id) => `#/sessions/${encodeURIComponent(id)}`,
  fault: (id) => `#/faults?fault=${encodeURIComponent(id)}`,
};

/** @param {api.AuditEntry} entry */
function subjectOf({ action, subject }) {
  const place = PLACES[action.split(".")[0]];
  if (!place || /(deleted|removed)$/.test(action)) return html`<span class="mono muted">${subject}</span>`;
  return html`<a class="mono" href="${place(subject)}">${subject}</a>`;
}

/**
 * Only what differs, as `field: before → after`.
 * @param {Record<string, unknown> | null} before
 * @param {Record<string, unknown> | null} after
 */
export function difference(before, after) {
  const names = [...new Set([...Object.keys(before ?? {}), ...Object.keys(after ?? {})])].filter(
    (name) => !DULL.has(name),
  );
  const words = (/** @type {unknown} */ value) => (typeof value === "string" ? value : JSON.stringify(value));
  return names
    .filter((name) => JSON.stringify(before?.[name] ?? null) !== JSON.stringify(after?.[name] ?? null))
    .map((name) => {
      const [was, is] = [before?.[name], after?.[name]];
      if (was === undefined || was === null) return `${name}: ${words(is)}`;
      if (is === undefined || is === null) return `${name}: ${words(was)} → –`;
      return `${name}: ${words(was)} → ${words(is)}`;
    })
    .join(" · ");
}
