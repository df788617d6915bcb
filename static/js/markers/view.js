// The surveyed markers: a table to search, a CSV to take out and to bring in.

import * as api from "../api.js";
import { number } from "../format.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/** More rows than this say nothing to a reader; the search narrows them. */
const MOST_ROWS = 300;

/** @type {import("../ui/router.js").MakeView} */
export function markersView(app, side) {
  render(side, html`<div class="page">
    <h1 data-t="nav.markers"></h1>
    <p class="lead" data-t="markers.lead"></p>
    <div class="block">
      <div class="row">
        <input type="search" class="grow" data-t-hint="markers.search" data-t-label="markers.search" autocomplete="off">
        <a href="${api.markersFile}" download data-t="markers.export"></a>
        <button type="button" class="import" data-t="markers.import"></button>
        <input type="file" accept=".csv,text/csv" hidden data-testid="markers-file">
      </div>
      <div class="answer" aria-live="polite"></div>
      <p class="muted count"></p>
      <div class="scroll"><table data-testid="markers"><thead><tr><th data-t="markers.name"></th><th class="num" data-t="axis.east"></th><th class="num" data-t="axis.north"></th><th class="num" data-t="axis.up"></th><th><span class="unseen" data-t="markers.show"></span></th></tr></thead><tbody></tbody></table></div>
    </div></div>`);
  translate(side);
  /** @type {{name: string, e_m: number, n_m: number, u_m: number | null}[]} */
  let markers = [];
  let gone = false;
  const search = /** @type {HTMLInputElement} */ (one("input[type=search]", side));
  const file = /** @type {HTMLInputElement} */ (one("input[type=file]", side));

  async function fetchMarkers() {
    try {
      const list = await api.markers();
      if (gone) return;
      markers = list;
      show();
    } catch (error) {
      if (!gone) render(one(".answer", side), problemBox(error));
    }
  }

  function show() {
    const wanted = search.value.trim().toUpperCase();
    const hits = markers.filter((m) => m.name.toUpperCase().includes(wanted));
    render(one(".count", side), html`${t("markers.count", { shown: Math.min(hits.length, MOST_ROWS), hits: hits.length, all: markers.length })}`);
    render(one("tbody", side), html`${hits.slice(0, MOST_ROWS).map((m) => html`<tr><td><b>${m.name}</b></td><td class="num">${number(m.e_m, 3)}</td><td class="num">${number(m.n_m, 3)}</td><td class="num">${number(m.u_m, 3)}</td><td class="num"><a href="#/live" data-marker="${m.name}">${t("markers.show")}</a></td></tr>`)}`);
  }

  search.addEventListener("input", show);
  one(".import", side).addEventListener("click", () => file.click());
  file.addEventListener("change", async () => {
    const chosen = file.files?.[0];
    if (!chosen) return;
    try {
      const { added, changed, unchanged } = await api.importMarkers(chosen);
      render(one(".answer", side), html`<div class="done" role="status">${t("markers.imported", { file: chosen.name, added, changed, unchanged })}</div>`);
      await fetchMarkers();
    } catch (error) {
      render(one(".answer", side), problemBox(error));
    }
    file.value = "";
  });
  const onClick = (/** @type {Event} */ event) => {
    const name = /** @type {HTMLElement} */ (event.target).closest("[data-marker]")?.getAttribute("data-marker");
    const marker = markers.find((m) => m.name === name);
    if (!marker) return;
    app.ui.goal = app.grid.named(marker.name)?.name ?? null;
    // The map is only there once the live screen is.
    addEventListener("hashchange", () => app.stage.goTo([marker.e_m, marker.n_m], 3), { once: true });
  };
  side.addEventListener("click", onClick);
  fetchMarkers();
  return {
    update(changed) {
      if (changed.has("markers")) fetchMarkers();
    },
    close() {
      gone = true;
      side.removeEventListener("click", onClick);
    },
  };
}
