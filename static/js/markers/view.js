// The surveyed markers: table and map together, each marker's details beside them, and files step by step.

import * as api from "../api.js";
import { number } from "../format.js";
import { html, one, render, setAttribute } from "../html.js";
import { t, translate } from "../i18n.js";
import { drawSurvey } from "../map/survey.js";
import { problemBox } from "../ui/problem.js";
import { makeDetails } from "./details.js";
import { makeFiles } from "./files.js";

/** @typedef {{name: string, e_m: number, n_m: number, u_m: number | null, version: number, updated_at: string}} Marker */
/**
 * @typedef {{
 *   marker: string, visits: number, rejected: number, sessions: number, mean_m: number[], mean_length_m: number, mean_direction_deg: number,
 *   rms_m: number, largest_m: number, p_value: number | null, suspect: boolean,
 * }} MarkerResiduals
 */

/** More rows than this say nothing to a reader; the filters narrow them. */
const MOST_ROWS = 300;
/** A click on the map means the marker within this reach, px. */
const REACH_PX = 14;

/** How an address names the session whose survey is to be compared with the table. */
const OF_SURVEY = "survey-";

/** @type {import("../ui/router.js").MakeView} */
export function markersView(app, side, argument) {
  render(
    side,
    html` <div class="side-head">
        <div class="row">
          <h1 class="grow" data-t="nav.markers"></h1>
          ${app.may("survey") && html`<button type="button" data-action="add" data-t="markers.add"></button><button type="button" data-action="files" data-t="markers.import" data-testid="import-markers"></button>`}<a
            class="button"
            href="${api.markersFile}"
            download
            data-t="markers.export"
          ></a>
        </div>
        <div class="row filters for-table">
          <input
            type="search"
            class="grow"
            data-t-hint="markers.search"
            data-t-label="markers.search"
            autocomplete="off"
          />
          <select data-filter="sector" data-t-label="markers.sector"></select>
          <button type="button" data-action="suspects" aria-pressed="false" data-testid="suspects"></button>
        </div>
        <p class="muted count for-table" aria-live="polite"></p>
      </div>
      <div class="answer"></div>
      <div class="list">
        <table class="markers" data-testid="markers">
          <thead>
            <tr>
              <th data-t="markers.name"></th>
              <th class="num" data-t="axis.east_m"></th>
              <th class="num" data-t="axis.north_m"></th>
              <th class="num" data-t="axis.up_m"></th>
              <th class="num" data-t="markers.visits"></th>
              <th class="num" data-t="markers.off"></th>
            </tr>
          </thead>
          <tbody></tbody>
        </table>
      </div>
      <div class="files" hidden></div>`,
  );
  translate(side);
  render(
    one("#legend"),
    html`<span
      ><svg viewBox="0 0 16 16" aria-hidden="true">
        <rect x="3" y="3" width="10" height="10" fill="none" stroke="currentColor" stroke-width="2" /></svg
      >${t("markers.suspect_survey")}</span
    >`,
  );

  /** @type {Marker[]} */
  let markers = [];
  /** @type {Map<string, MarkerResiduals>} */
  let residuals = new Map();
  let onlySuspects = false;
  /** @type {string | null} */
  let chosen = null;
  let gone = false;
  const survey = /** @type {import("../map/survey.js").Survey} */ ({ selected: null, suspects: [], differences: [] });
  app.survey = survey;
  const canvas = (app.layers.survey ??= app.stage.canvas(
    "trails",
    drawSurvey(() => app.survey),
  ));
  canvas.setShown(true);

  const search = /** @type {HTMLInputElement} */ (one("input[type=search]", side));
  const sector = /** @type {HTMLSelectElement} */ (one("[data-filter=sector]", side));
  const suspectsButton = one("[data-action=suspects]", side);
  render(
    sector,
    html`<option value="">${t("markers.all_sectors")}</option>
      ${app.plan.sectors.map((s) => html`<option value="${s.name}">${t("markers.in_sector", { sector: s.name })}</option>`)}`,
  );
  const sectorOf = new Map(app.plan.nodes.map((node) => [node.name, node.sector]));

  const details = makeDetails(app, {
    residualsOf: (name) => residuals.get(name) ?? null,
    /** The place that is shown while it is edited. */
    preview(place) {
      survey.selected = place;
      canvas.invalidate();
    },
    async changed(name) {
      await fetchAll();
      choose(name);
    },
    closed: () => choose(null),
  });
  const files = makeFiles(app, one(".files", side), {
    /** @param {import("../map/survey.js").Difference[]} differences */
    shown(differences) {
      survey.differences = differences;
      canvas.invalidate();
    },
    changed: fetchAll,
    closed: () => showFiles(false),
  });

  async function fetchAll() {
    try {
      const [list, told] = await Promise.all([api.markers(), api.residuals()]);
      if (gone) return;
      markers = list;
      residuals = new Map(told.markers.map((/** @type {MarkerResiduals} */ r) => [r.marker, r]));
      render(one(".answer", side), html``);
      show();
    } catch (error) {
      if (!gone) render(one(".answer", side), problemBox(error));
    }
  }

  function show() {
    const wanted = search.value.trim().toUpperCase();
    const hits = markers.filter(
      (m) =>
        m.name.toUpperCase().includes(wanted) &&
        (sector.value === "" || (sectorOf.get(m.name) ?? m.name[0]) === sector.value) &&
        (!onlySuspects || residuals.get(m.name)?.suspect),
    );
    const suspects = markers.filter((m) => residuals.get(m.name)?.suspect);
    survey.suspects = suspects.map((m) => ({
      e_m: m.e_m,
      n_m: m.n_m,
      mean_m: residuals.get(m.name)?.mean_m ?? [0, 0],
    }));
    canvas.invalidate();
    suspectsButton.textContent = t("markers.suspects", { n: suspects.length });
    setAttribute(suspectsButton, "aria-pressed", String(onlySuspects));
    render(
      one(".count", side),
      html`${t("markers.count", { shown: Math.min(hits.length, MOST_ROWS), hits: hits.length, all: markers.length })}`,
    );
    render(
      one(".markers tbody", side),
      html`${hits.slice(0, MOST_ROWS).map((m) => {
        const found = residuals.get(m.name);
        return html`<tr${m.name === chosen && html` aria-selected="true"`}><td><button type="button" class="quiet name" data-marker="${m.name}"${m.name === chosen && html` aria-current="true"`}>${m.name}</button></td>
        <td class="num">${number(m.e_m, 3)}</td><td class="num">${number(m.n_m, 3)}</td><td class="num">${number(m.u_m, 3)}</td>
        <td class="num">${found ? found.visits : ""}</td><td class="num${found?.suspect && " warn"}">${found && html`${number(found.mean_length_m, 2)}${found.suspect && html` <b title="${t("markers.suspect_survey")}">!</b>`}`}</td></tr>`;
      })}`,
    );
  }

  /** @param {string | null} name */
  function choose(name, go = false) {
    const marker = markers.find((m) => m.name === name) ?? null;
    chosen = marker?.name ?? null;
    survey.selected = marker;
    details.show(marker);
    if (marker && go) app.stage.goTo([marker.e_m, marker.n_m], 3);
    canvas.invalidate();
    show();
  }

  /**
   * @param {boolean} shown
   * @param {string} [surveyed] the session whose survey is compared with the table
   */
  function showFiles(shown, surveyed) {
    one(".files", side).hidden = !shown;
    one(".list", side).hidden = shown;
    if (shown) {
      choose(null);
      files.open(surveyed);
    } else {
      survey.differences = [];
      canvas.invalidate();
    }
    setAttribute(one("[data-action=files]", side), "aria-expanded", String(shown));
  }

  const onClick = (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const name = target.closest(".list [data-marker]")?.getAttribute("data-marker");
    if (name) {
      if (!details.busy()) choose(name === chosen ? null : name, true);
      return;
    }
    switch (target.closest("[data-action]")?.getAttribute("data-action")) {
      case "suspects":
        onlySuspects = !onlySuspects;
        return show();
      case "files":
        return showFiles(one(".list", side).hidden === false);
      case "add":
        if (details.busy()) return;
        choose(null);
        return details.add();
    }
  };
  side.addEventListener("click", onClick);
  search.addEventListener("input", show);
  sector.addEventListener("change", show);
  const onMapClick = (/** @type {L.LeafletMouseEvent} */ event) => {
    if (details.busy()) return;
    const reach_m = REACH_PX / 2 ** app.stage.map.getZoom();
    const [e, n] = [event.latlng.lng, event.latlng.lat];
    const near = markers
      .map((m) => ({ m, d: Math.hypot(m.e_m - e, m.n_m - n) }))
      .filter(({ d }) => d <= reach_m)
      .sort((a, b) => a.d - b.d)[0];
    choose(near ? near.m.name : null);
  };
  app.stage.map.on("click", onMapClick);
  fetchAll();
  const surveyed = argument.startsWith(OF_SURVEY) ? argument.slice(OF_SURVEY.length) : "";
  if (surveyed && app.may("survey")) {
    // Once: the same address does not compare it again.
    history.replaceState(null, "", "#/markers");
    showFiles(true, surveyed);
  }

  return {
    update(changed) {
      if (changed.has("markers")) fetchAll().then(() => details.refreshed(markers));
    },
    close() {
      gone = true;
      app.survey = null;
      details.close();
      files.close();
      side.removeEventListener("click", onClick);
      app.stage.map.off("click", onMapClick);
    },
  };
}
