// One walk: drawn with and without markers, what each marker changed, what was wrong with the sensors, and
// the figures. The address can be sent on.

import * as api from "../api.js";
import { bytes, dateTime, elapsed, heading, length, number } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { t, tOr, translate } from "../i18n.js";
import { eastNorth } from "../map/stage.js";
import { offBefore, visitOutcome, visitTime } from "../state/findings.js";
import { standCards, standClicked } from "../stands/list.js";
import { reportCard } from "./report.js";
import { problemBox } from "../ui/problem.js";
import { drawChart } from "./chart.js";
import { stateTag } from "./list.js";
import { corrections, indexAt, line, nearestIndex, readTrack } from "./track.js";

/** Points a second that are fetched: a point every 0.7 m at walking pace, closer where the walk is short. */
const LEAST_RATE_HZ = 2;
const MOST_RATE_HZ = 10;
const ENOUGH_POINTS = 5000;
/** @type {Record<string, string>} */
const OUTCOME_TONES = { accepted: "good", rejected: "bad", waiting: "" };
const EXPORTS = ["csv", "geojson", "gpx", "kml"];

/** @type {import("../ui/router.js").MakeView} */
export function sessionView(app, side, id) {
  render(side, html`<div class="session" data-testid="session" data-session="${id}">
    <a href="#/sessions">← ${t("nav.sessions")}</a>
    <div class="head"><p class="muted">${t("loading")}</p></div>
    <section class="runs-choice" hidden></section>
    <section class="time" hidden>
      <h2 data-t="session.sigma_over_time"></h2>
      <canvas class="chart" aria-hidden="true"></canvas>
      <div class="time-bar"><span class="from mono">0:00</span><input type="range" min="0" max="1" step="0.5" value="0" data-t-label="session.time"><span class="to mono"></span></div>
      <p class="cursor muted" aria-live="off"></p>
    </section>
    <section class="report"></section>
    <section class="visits"></section>
    <section class="stands"></section>
    <section class="anomalies"></section>
    <section class="files"></section>
  </div>`);
  translate(side);

  let gone = false;
  /** @type {import("./track.js").Track | null} */
  let main = null;
  /** @type {import("./track.js").Track | null} */
  let without = null;
  /** @type {import("./track.js").Track | null} */
  let filtered = null;
  /** @type {import("../state/live.js").Visit[]} */
  let visits = [];
  /** @type {import("../state/live.js").Stand[]} */
  let stands = [];
  /** Jobs of this walk that have ended and been looked at. @type {Set<string>} */
  const seen = new Set();
  /** @type {any} */
  let known = null;
  /** @type {number | null} */
  let cursor_s = null;
  const show = { main: true, filtered: false, without: true, arrows: true };
  /** @type {import("../map/runs.js").Runs} */
  const runs = { main: null, filtered: null, without: null, corrections: [], cursor: null, arrows: true, selected: null };
  app.runs = runs;
  // A walk is looked at closely; the other screens want the map as they left it.
  const showAsBefore = app.stage.remember();
  const slider = /** @type {HTMLInputElement} */ (one("input[type=range]", side));

  /** Whether a job of this walk has ended since the last look. */
  function lookAtJobs() {
    const ended = [...app.live.jobs.values()].filter((j) => j.session_id === id && (j.state === "finished" || j.state === "failed") && !seen.has(j.id));
    ended.forEach((j) => seen.add(j.id));
    return ended.length > 0;
  }

  function redraw() {
    runs.main = show.main && main ? line(main) : null;
    runs.filtered = show.filtered && filtered ? line(filtered) : null;
    runs.without = show.without && without ? line(without) : null;
    runs.arrows = show.arrows;
    legend();
    moveCursor();
  }

  function moveCursor() {
    const track = main ?? without;
    if (track && cursor_s !== null && track.t_s.length > 0) {
      const i = indexAt(track, cursor_s);
      runs.cursor = [track.e_m[i], track.n_m[i]];
      const near = app.grid.nearest(track.e_m[i], track.n_m[i], 1, 40)[0];
      setText(one(".cursor", side), [
        elapsed(track.t_s[i]),
        `E ${number(track.e_m[i], 1)}`, `N ${number(track.n_m[i], 1)}`, `U ${number(track.u_m[i], 1)} m`,
        `σ ${length(track.sigma_m[i])}`, heading(track.heading_rad[i]),
        ...(near ? [`${near.place.name} ${length(near.distance_m)}`] : []),
      ].join(" · "));
    }
    const curves = [];
    if (without && show.without) curves.push({ track: without, colour: /** @type {const} */ ("runB"), dash: [5, 4] });
    if (main && show.main) curves.push({ track: main, colour: /** @type {const} */ ("runA"), dash: [] });
    drawChart(/** @type {HTMLCanvasElement} */ (side.querySelector("canvas")), curves, visits.map(visitTime), cursor_s);
    app.layers.runs.invalidate();
  }

  function legend() {
    const key = (/** @type {string} */ cls, /** @type {string} */ words) =>
      html`<span><svg class="long" viewBox="0 0 28 13" aria-hidden="true"><path class="run-line ${cls}" d="M1 6.5 H27"/></svg>${t(words)}</span>`;
    render(one("#legend"), html`
      ${runs.main && key("main-run", mainName())}
      ${runs.filtered && key("filtered-run", "session.run.filtered")}
      ${runs.without && key("without-run", "session.run.without_markers")}
      ${runs.arrows && runs.corrections.length > 0 && key("arrow-run", "session.run.arrows")}`);
  }

  /** A walk without a second run has just a track. */
  function mainName() {
    return without ? "session.run.main" : "session.run.only";
  }

  async function load() {
    try {
      const [row, list, found, stood] = await Promise.all([api.session(id), api.visits(id), api.anomalies(id), api.stands(id)]);
      if (gone) return;
      visits = list;
      stands = stood;
      known = row;
      showHead(row);
      showVisits();
      showStands();
      showAnomalies(found);
      showFiles(row);
      // A walk that was never processed has none.
      if (row.state === "finished") api.report(id).then((report) => gone || render(one(".report", side), reportCard(report)), () => {});
      if (row.state !== "finished" && !(row.epochs > 0)) return;
      const rate_hz = Math.min(MOST_RATE_HZ, Math.max(LEAST_RATE_HZ, Math.floor(ENOUGH_POINTS / Math.max(1, row.duration_s))));
      const [a, b, c] = await Promise.allSettled([api.track(id, "main", rate_hz), api.track(id, "without_markers", rate_hz), api.track(id, "filtered", rate_hz)]);
      if (gone) return;
      if (a.status === "rejected") throw a.reason;
      main = readTrack(a.value);
      // A walk without a single visit has only one run.
      without = b.status === "fulfilled" && b.value.rows.length > 0 ? readTrack(b.value) : null;
      // One that was never worked out, live for instance, has no other than the filter's.
      filtered = c.status === "fulfilled" && c.value.rows.length > 0 ? readTrack(c.value) : null;
      runs.corrections = corrections(visits, (name) => app.grid.named(name));
      showRunChoice();
      const end_s = main.t_s[main.t_s.length - 1] ?? 0;
      slider.max = String(end_s);
      setText(one(".to", side), elapsed(end_s));
      one(".time", side).hidden = main.t_s.length === 0;
      redraw();
      app.stage.show([...line(main), ...(without ? line(without) : [])]);
      one(".session", side).dataset.drawn = "yes";
    } catch (error) {
      if (gone) return;
      // What is known of the walk stays, also when its track cannot be had.
      const place = one(known ? ".runs-choice" : ".head", side);
      place.hidden = false;
      render(place, problemBox(error));
    }
  }

  /** @param {any} row */
  function showHead(row) {
    const name = app.live.inspectors.get(row.inspector_id)?.name ?? "–";
    const used = visits.filter((v) => v.accepted);
    const offs = used.map((v) => offBefore(v) ?? 0);
    const figure = (/** @type {string} */ value, /** @type {string} */ key) => html`<div><b>${value}</b><small>${t(key)}</small></div>`;
    render(one(".head", side), html`
      <h1>${row.title || name}</h1>
      <p class="muted">${row.title && html`${name} · `}${dateTime(row.started_at)} ${t("zone")} ${stateTag(row.state)}</p>
      ${row.error && html`<div class="problem"><b>${t("problem.failed")}</b><p>${typeof row.error === "string" ? row.error : (row.error.detail ?? row.error.title)}</p></div>`}
      <div class="figures" data-testid="figures">
        ${figure(length(row.distance_m), "session.distance")}
        ${figure(elapsed(row.duration_s), "session.duration")}
        ${figure(`${used.length} / ${visits.length}`, "session.visits_used")}
        ${figure(offs.length > 0 ? length(offs.reduce((a, b) => a + b, 0) / offs.length) : "–", "session.mean_off")}
        ${figure(offs.length > 0 ? length(Math.max(...offs)) : "–", "session.largest_off")}
        ${figure(row.samples ? Number(row.samples).toLocaleString("en") : "–", "session.samples")}
      </div>
      ${row.track_sha256 && html`<p class="mono muted" title="${t("session.digest")}">${t("session.digest")}: ${row.track_sha256}</p>`}`);
  }

  function showRunChoice() {
    const box = one(".runs-choice", side);
    box.hidden = false;
    render(box, html`<fieldset><legend>${t("session.shown")}</legend><div class="choices">
      <label><input type="checkbox" name="main" checked>${t(mainName())}</label>
      ${filtered && html`<label><input type="checkbox" name="filtered">${t("session.run.filtered")}</label>`}
      ${without && html`<label><input type="checkbox" name="without" checked>${t("session.run.without_markers")}</label>`}
      ${runs.corrections.length > 0 && html`<label><input type="checkbox" name="arrows" checked>${t("session.run.arrows")}</label>`}
    </div></fieldset>`);
  }

  function showVisits() {
    render(one(".visits", side), html`<h2>${t("session.visits")}</h2>${visits.length === 0
      ? html`<p class="muted">${t("session.no_visits")}</p>`
      : html`<div class="scroll"><table data-testid="visits"><thead><tr><th>${t("session.time")}</th><th>${t("session.marker")}</th><th>${t("session.outcome")}</th><th class="num">${t("session.before")}</th><th class="num">ΔE</th><th class="num">ΔN</th><th class="num">NIS</th></tr></thead>
        <tbody>${visits.map((v) => {
          const off = v.before_minus_marker_m;
          const outcome = visitOutcome(v);
          return html`<tr><td>${elapsed(visitTime(v))}</td><td><button type="button" data-visit="${v.marker}">${v.marker}</button></td>
            <td><span class="tag ${OUTCOME_TONES[outcome]}">${t(`visit.${outcome}`)}</span></td>
            <td class="num">${length(offBefore(v))}</td><td class="num">${number(off?.[0], 1)}</td><td class="num">${number(off?.[1], 1)}</td><td class="num">${number(v.nis, 1)}</td></tr>
            ${v.reason && html`<tr class="reason"><td></td><td colspan="6"><small class="muted">${v.reason}</small></td></tr>`}`;
        })}</tbody></table></div>`}`);
  }

  /** @param {unknown} [error] */
  function showStands(error) {
    render(one(".stands", side), html`<h2>${t("stand.title")}</h2>
      <label><input type="checkbox" name="automatic" ${known?.automatic_visits && "checked"}>${t("stand.automatic")}</label>
      <p class="muted">${t("stand.automatic_hint")}</p>
      ${error !== undefined && problemBox(error)}
      ${stands.length === 0 ? html`<p class="muted">${t("stand.none")}</p>` : html`<div data-testid="stands">${standCards(stands, visits)}</div>`}`);
  }

  /**
   * Something was asked for that changes the visits; the track follows when its job has ended.
   * @param {Promise<unknown>} asked
   */
  async function ask(asked) {
    try {
      await asked;
      await lookAtStands();
    } catch (error) {
      if (!gone) showStands(error);
    }
  }

  async function lookAtStands() {
    const [row, list, stood] = await Promise.all([api.session(id), api.visits(id), api.stands(id)]);
    if (gone) return;
    known = row;
    visits = list;
    stands = stood;
    showHead(row);
    showVisits();
    showStands();
  }

  /** @param {import("../state/live.js").Anomaly[]} found */
  function showAnomalies(found) {
    render(one(".anomalies", side), html`<h2>${t("session.anomalies")}</h2>${found.length === 0
      ? html`<p class="muted">${t("session.no_anomalies")}</p>`
      : html`<div class="scroll"><table data-testid="anomalies"><thead><tr><th>${t("session.time")}</th><th>${t("session.what")}</th><th>${t("session.foot")}</th><th>${t("session.found")}</th></tr></thead>
        <tbody>${found.map((a) => html`<tr><td>${elapsed(a.t_start_ns / 1e9)}</td><td>${tOr(`anomaly.${a.anomaly}`, a.anomaly)}</td><td>${a.foot ? t(`foot.${a.foot}`) : "–"}</td><td>${a.detail}</td></tr>`)}</tbody></table></div>`}`);
  }

  /** @param {any} row */
  function showFiles(row) {
    render(one(".files", side), html`
      <h2>${t("session.exports")}</h2>
      <p class="row">${EXPORTS.map((f) => html`<a href="${api.trackFile(id, f)}" download>${f === "csv" ? "CSV" : f === "geojson" ? "GeoJSON" : f.toUpperCase()}</a>`)}</p>
      ${row.logs?.length > 0 && html`<h3>${t("session.logs")}</h3>${row.logs.map((/** @type {any} */ l) => html`<p>${t(`foot.${l.foot}`)}: ${l.file_name ?? "–"} · ${l.size_bytes ? bytes(l.size_bytes) : "–"} · ${Number(l.samples ?? 0).toLocaleString("en")} ${t("session.samples")}</p>`)}`}`);
  }

  const onClick = (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const asked = standClicked(target, id);
    if (asked) ask(asked);
    const name = target.closest("[data-visit]")?.getAttribute("data-visit");
    if (!name) return;
    runs.selected = name;
    const place = app.grid.named(name);
    if (place) app.stage.goTo([place.e_m, place.n_m], 2.5);
    app.layers.runs.invalidate();
  };
  one(".runs-choice", side).addEventListener("change", (event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    show[/** @type {keyof typeof show} */ (input.name)] = input.checked;
    redraw();
  });
  one(".stands", side).addEventListener("change", (event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    if (input.name === "automatic") ask(api.setAutomaticVisits(id, input.checked));
  });
  const onSlide = () => {
    cursor_s = Number(slider.value);
    moveCursor();
  };
  const onMapClick = (/** @type {L.LeafletMouseEvent} */ event) => {
    const track = main ?? without;
    if (!track) return;
    const i = nearestIndex(track, eastNorth(event.latlng), 14 / 2 ** app.stage.map.getZoom());
    if (i === null) return;
    cursor_s = track.t_s[i];
    slider.value = String(cursor_s);
    moveCursor();
  };
  side.addEventListener("click", onClick);
  slider.addEventListener("input", onSlide);
  app.stage.map.on("click", onMapClick);
  lookAtJobs();
  load();

  return {
    update(changed) {
      // The session was worked on: its end is worth a new look.
      if (changed.has("job") && lookAtJobs()) load();
      else if (known?.state === "live" && (changed.has("stand") || changed.has("visit"))) ask(Promise.resolve());
      if (changed.has("all")) {
        // The inspectors' names come with the feed.
        if (known) showHead(known);
        moveCursor();
      }
    },
    close() {
      gone = true;
      side.removeEventListener("click", onClick);
      app.stage.map.off("click", onMapClick);
      showAsBefore();
    },
  };
}
