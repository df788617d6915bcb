// The live screen: everybody in a list, those who need attention first, and the open faults.

import { endSession } from "../api.js";
import { sectorAt } from "../geometry.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { faultCards } from "../faults/cards.js";
import { severitySymbol, presenceGlyph } from "../ui/symbols.js";
import { makeDrawer } from "./drawer.js";
import { PeopleList } from "./people_list.js";

/** @type {import("../ui/router.js").MakeView} */
export function liveView(app, side) {
  render(
    side,
    html` <div class="side-head">
        <h1 class="unseen" data-t="live.title"></h1>
        <input
          type="search"
          id="search"
          data-t-hint="live.search"
          data-t-label="live.search"
          autocomplete="off"
          value="${app.ui.search}"
        />
        <select id="sector" data-t-label="live.sector"></select>
        <p class="summary" data-testid="summary"></p>
        <p class="left-open"></p>
      </div>
      <div class="columns" aria-hidden="true">
        <span></span><span data-t="live.who"></span><span class="num" data-t="live.sigma"></span
        ><span class="num" data-t="live.since_marker"></span>
      </div>
      <ol class="people" data-testid="people" data-t-label="live.title"></ol>
      <div class="list-title">
        <h2 data-t="live.open_faults"></h2>
        <a href="#/faults" data-t="live.all_faults"></a>
      </div>
      <div class="faults" data-testid="live-faults"></div>`,
  );
  translate(side);
  render(
    one("#legend"),
    html` ${["walking", "standing", "silent", "lost"].map((p) => html`<span>${presenceGlyph(p)}${t(`presence.${p}`)}</span>`)}
    ${["low", "medium", "high"].map((s) => html`<span>${severitySymbol(s)}${t(`severity.${s}`)}</span>`)}`,
  );

  const list = new PeopleList(app, one(".people", side));
  const drawer = makeDrawer(app, one("#drawer"));
  const search = /** @type {HTMLInputElement} */ (one("#search", side));
  search.addEventListener("input", () => {
    app.ui.search = search.value;
    app.changed("choice");
  });
  search.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    const first = list.shown()[0];
    if (first) app.select(first.inspector.id);
  });
  const sector = /** @type {HTMLSelectElement} */ (one("#sector", side));
  render(
    sector,
    html`<option value="">${t("live.all_sectors")}</option>
      ${app.plan.sectors.map((s) => html`<option value="${s.name}">${t("live.in_sector", { sector: s.name })}</option>`)}`,
  );
  sector.value = app.ui.sector;
  sector.addEventListener("change", () => {
    app.ui.sector = sector.value;
    app.changed("choice");
  });
  const faults = one(".faults", side);
  faults.addEventListener("click", (event) => {
    const id = /** @type {HTMLElement} */ (event.target).closest("[data-fault]")?.getAttribute("data-fault");
    const fault = id ? app.live.faults.get(id) : undefined;
    if (!fault) return;
    app.ui.fault = fault.id;
    app.ui.follow = false;
    if (fault.position_m) app.stage.goTo([fault.position_m[0], fault.position_m[1]], 2);
    app.changed("choice");
  });

  one(".left-open", side).addEventListener("click", async (event) => {
    if (!(/** @type {HTMLElement} */ (event.target).closest("button"))) return;
    // One that somebody else has ended meanwhile needs no end.
    for (const { session } of leftOpen(app)) if (session) await endSession(session.id).catch(() => undefined);
  });

  return {
    update(changed) {
      list.update();
      drawer.update(changed);
      showSummary(app, one(".summary", side));
      const n = leftOpen(app).length;
      render(
        one(".left-open", side),
        n > 0 ? html`<button type="button" data-testid="end-left">${t("live.end_open", { n })}</button>` : html``,
      );
      if (["all", "fault", "choice", "session"].some((topic) => changed.has(/** @type {any} */ (topic)))) {
        const here = app.layers.openFaults().filter(({ position_m }) => {
          if (app.ui.sector === "") return true;
          // One whose place is unknown may be anywhere.
          return !position_m || sectorAt(app.plan.sectors, [position_m[0], position_m[1]]) === app.ui.sector;
        });
        render(faults, faultCards(app, here));
      }
    },
    close: () => drawer.close(),
  };
}

/** Walks that nobody ended, of those whose walks may be written. @param {import("../app.js").App} app */
const leftOpen = (app) =>
  app.past ? [] : app.people().filter((p) => p.presence === "gone" && app.writesFor(p.inspector.id));

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} el
 */
function showSummary(app, el) {
  const people = app.people();
  const count = (/** @type {string[]} */ ...presences) => people.filter((p) => presences.includes(p.presence)).length;
  const silent = count("silent");
  const lost = count("lost");
  const faults = app.layers.openFaults().length;
  const part = (/** @type {string} */ key, /** @type {number} */ n, tone = "") =>
    html`<span class="${n > 0 ? tone : ""}"><b>${n}</b> ${t(key)}</span>`;
  render(
    el,
    html` ${part("live.out", count("walking", "standing", "silent", "lost", "starting"))}
    ${silent > 0 && part("presence.silent", silent, "warn")} ${lost > 0 && part("presence.lost", lost, "bad")}
    ${part("live.faults_open", faults)}`,
  );
}
