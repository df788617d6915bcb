// What was written on paper, keyed in afterwards: a line for each marker with the time of day, or a table.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/** An inspector who notes a time has stood there for about this long, s. */
const STOOD_S = 4;
/** A time without seconds is anywhere in its minute, s. */
const MINUTE_S = 59;
const DAY_S = 86_400;
/** How the site's clock stands to UTC, s. */
const ZONE_S = 8 * 3600;

/**
 * @param {string} text a line each: `10:04 A17` or `10:04:30 A17`, site time
 * @param {string} started_at of the walk
 * @param {(name: string) => string | undefined} markerNamed the marker's own spelling
 * @returns {{visits: {marker: string, t_start_s: number, t_end_s: number}[], wrong: {line: number, found: string}[]}}
 */
export function readPaper(text, started_at, markerNamed) {
  const started_s = Date.parse(started_at) / 1000;
  const midnight_s = Math.floor((started_s + ZONE_S) / DAY_S) * DAY_S - ZONE_S;
  const visits = [];
  const wrong = [];
  for (const [i, line] of text.split("\n").entries()) {
    if (line.trim() === "") continue;
    const found = /^\s*(\d{1,2})[:：](\d{2})(?:[:：](\d{2}))?[\s,;，；]+(\S+)\s*$/u.exec(line);
    const marker = found && markerNamed(found[4]);
    const [h, m, s] = found ? [found[1], found[2], found[3] ?? "0"].map(Number) : [99, 99, 99];
    if (!marker || h > 23 || m > 59 || s > 59) {
      wrong.push({ line: i + 1, found: line.trim() });
      continue;
    }
    let at_s = midnight_s + h * 3600 + m * 60 + s - started_s;
    // A walk goes over midnight; none goes on for half a day.
    if (at_s < -DAY_S / 2) at_s += DAY_S;
    else if (at_s > DAY_S / 2) at_s -= DAY_S;
    const [from_s, to_s] = found?.[3] === undefined ? [at_s, at_s + MINUTE_S] : [at_s - STOOD_S, at_s];
    visits.push({ marker, t_start_s: round(from_s), t_end_s: round(to_s) });
  }
  return { visits, wrong };
}

/** @param {number} s */
const round = (s) => Math.round(s * 1000) / 1000;

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} box
 * @param {any} row the session
 * @param {() => void} onAdded
 */
export function showPaper(app, box, row, onAdded) {
  if (!app.writesFor(row.inspector_id) || row.state === "live") return;
  const fresh = render(
    box,
    html`<details data-testid="paper">
      <summary>${t("paper.title")}</summary>
      <form data-draft class="manage">
        <label class="field"
          ><span>${t("paper.lines")}</span
          ><textarea name="lines" rows="6" spellcheck="false" autocomplete="off" placeholder="10:04 A17"></textarea>
        </label>
        <label class="field"><span>${t("paper.table")}</span><input type="file" name="table" accept=".csv" /></label>
        <button class="main-action">${t("paper.add")}</button>
        <div class="answer" aria-live="polite"></div>
      </form>
    </details>`,
  );
  if (!fresh) return;
  const form = /** @type {HTMLFormElement} */ (one("form", box));
  const answer = one(".answer", form);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const data = new FormData(form);
    const { visits, wrong } = readPaper(
      String(data.get("lines") ?? ""),
      row.started_at,
      (name) => app.grid.named(name)?.name,
    );
    if (wrong.length > 0) {
      const { line, found } = wrong[0];
      return void render(answer, html`<p class="warning" role="alert">${t("paper.wrong", { line, found })}</p>`);
    }
    const table = data.get("table");
    try {
      let added = 0;
      if (visits.length > 0) added += (await api.tellVisits(row.id, visits)).added;
      if (table instanceof File && table.size > 0) added += (await (await api.addVisits(row.id, table)).json()).added;
      if (row.samples > 0 && added > 0) await api.processSession(row.id);
      render(answer, html`<p class="good">${t("paper.added", { n: added })}</p>`);
      onAdded();
    } catch (error) {
      render(answer, problemBox(error));
    }
  });
}
