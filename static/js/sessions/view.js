// One walk: its replay with map and charts, how good it is, its markers and its files. The address can be sent on.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { inkNamed } from "../map/ink.js";
import { aidsChoice, drawnAs, labChoice, runChoice, runName, walkChoice } from "../replay/run_picker.js";
import { readMoment, writeMoment } from "../replay/link.js";
import { STORED, aidsOf, isOwn, pathLength, runByAids, runNamed } from "../replay/runs.js";
import { makeReplay, walkOf } from "../replay/screen.js";
import { standCards, standClicked } from "../stands/list.js";
import { isUnknown, learnSystems, openSystem, systemOf } from "../systems/index.js";
import { problemBox } from "../ui/problem.js";
import { readRoute } from "../ui/router.js";
import { anomalyTable } from "./anomalies.js";
import { askedOffset, clockCard } from "./clock_tie.js";
import { fileList } from "./files.js";
import { showHead } from "./head.js";
import { showNote } from "./note.js";
import { healthCard, healthOf } from "./health.js";
import { reportCard } from "./report.js";
import { residualCard, residualsOf } from "./residuals.js";
import { LEAST_RATE_HZ } from "./open.js";
import { makeTabs } from "./tabs.js";
import { corrections, line, readTrack } from "./track.js";
import { showVisits } from "./visits.js";
import { untilDone } from "../lab/until_done.js";

const loadPaper = () => import("./paper.js");
const loadManage = () => import("./manage.js");
/** Points a second that are fetched in the end, where the walk is short. */
const MOST_RATE_HZ = 10;
const ENOUGH_POINTS = 5000;
/** A walk that goes on is fetched again this often, ms. */
const LIVE_MS = 3000;
const LIVE_CHARTS_MS = 20_000;

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} side
 * @param {string} id
 * @param {import("./open.js").Asked} asked what was asked for already
 * @param {() => import("./open.js").Asked} askAgain
 * @returns {import("../ui/router.js").View}
 */
export function sessionView(app, side, id, asked, askAgain) {
  const moment = readMoment(location.hash);
  render(
    side,
    html`<div class="session" data-testid="session" data-session="${id}">
      <a href="#/sessions">← ${t("nav.sessions")}</a>
      <div class="head"><p class="muted">${t("loading")}</p></div>
      <div class="said"></div>
      <div class="trouble" hidden></div>
      <div class="tabs" data-t-label="session.tabs"></div>
      <div data-panel="replay">
        <section class="board"></section>
        <section class="runs-choice"></section>
        <section class="of-system" hidden></section>
        <section class="aids-choice"></section>
        <section class="walk-choice"></section>
      </div>
      <div data-panel="quality">
        <section class="health"></section>
        <section class="residuals"></section>
        <section class="report"></section>
        <section class="anomalies"></section>
      </div>
      <div data-panel="markers">
        <section class="clock-tie"></section>
        <section class="visits"></section>
        <section class="paper"></section>
        <section class="stands"></section>
      </div>
      <div data-panel="files">
        <section class="files"></section>
        <section class="manage"></section>
      </div>
    </div>`,
  );
  translate(side);
  makeTabs(one(".tabs", side), side, ["replay", "quality", "markers", "files"]);
  const dock = document.createElement("section");
  dock.className = "dock";
  dock.setAttribute("aria-label", t("sessions.replay.label"));
  one("#main").append(dock);
  // Now, while nothing is drawn: each change of the map's room draws all of it anew.
  app.stage.map.invalidateSize({ animate: false });

  let gone = false;
  /** As the page knows it; the walk itself says so when it is there. */
  let system = systemOf(app.live.sessions.get(id));
  /** @type {import("../replay/run_picker.js").Run[]} */
  let runs = [];
  /** @type {import("../replay/screen.js").Walk | null} */
  let own = null;
  /** @type {import("../replay/screen.js").Walk[]} */
  let beside = [];
  /** @type {import("../replay/run_picker.js").OtherWalk[] | null} */
  let others = null;
  /** @type {string | null} */
  let computing = null;
  /** @type {import("../lab/view.js").LabRun[]} */
  let labRuns = [];
  /** @type {import("../state/live.js").Visit[]} */
  let visits = [];
  /** @type {import("../state/live.js").Stand[]} */
  let stands = [];
  /** @type {import("../state/live.js").Anomaly[]} */
  let anomalies = [];
  /** Jobs of this walk that have ended and been looked at. @type {Set<string>} */
  const seen = new Set();
  /** @type {any} */
  let known = null;
  let fetchedLive_ms = 0;
  /** @type {ReturnType<typeof import("../systems/cabin_board.js").makeBoard> | null} */
  let board = null;
  let charted_ms = performance.now();
  /** What the system shows beside the track. @type {import("../systems/system.js").Overlay | null} */
  let beyond = null;
  /** @type {import("../map/runs.js").RunCursor[]} */
  let moving = [];
  /** @type {import("../map/runs.js").Runs} */
  const onMap = {
    lines: [],
    get cursors() {
      return [...(beyond?.places ?? []), ...moving];
    },
    set cursors(moved) {
      moving = moved;
      showCard();
    },
    corrections: [],
    arrows: true,
    selected: null,
  };
  app.runs = onMap;
  // A walk is looked at closely; the other screens want the map as they left it.
  const showAsBefore = app.stage.remember();
  const replay = makeReplay(app, dock, id, system, {
    runs: onMap,
    walks: () => (own ? [own, ...beside] : []),
    visits: () => visits,
    isLive: () => known?.state === "live",
    detail: (from_s, to_s) => api.trackBetween(id, "main", from_s, to_s).then((table) => readTrack(table, system)),
    moved: (t_s) => {
      board?.seek(t_s);
      tellAddress();
    },
  });
  const alone = () => runs.filter((run) => isOwn(run.name)).length < 2;
  const nameOf = (/** @type {any} */ row) => app.live.inspectors.get(row.inspector_id)?.name ?? "–";

  function tellAddress() {
    // Somebody may have left already, and this screen not have heard of it.
    if (gone || !own || readRoute(location.hash).argument !== id) return;
    const shown = runs.filter((run) => run.shown).map((run) => run.name);
    history.replaceState(
      null,
      "",
      writeMoment(id, { t_s: replay.now(), runs: shown, beside: beside.map((walk) => walk.id) }),
    );
  }

  /** Whether a job of this walk has ended since the last look. */
  function lookAtJobs() {
    const ended = [...app.live.jobs.values()].filter(
      (j) =>
        j.session_id === id && !j.lab_run_id && (j.state === "finished" || j.state === "failed") && !seen.has(j.id),
    );
    ended.forEach((j) => seen.add(j.id));
    return ended.length > 0;
  }

  /** The runs and the other walks, on the map, in the legend and in the list. */
  function showRuns() {
    const shown = runs.filter((run) => run.shown);
    // The main one on top of all others.
    onMap.lines = [
      ...beside.map((walk) => ({ points: line(walk.track), ink: walk.ink, dash: [], width: 2 })),
      ...shown.toReversed().map((run) => ({ points: line(run.track), ink: run.ink, dash: run.dash, width: run.width })),
      ...(shown.some((run) => run.name === "main") ? (beyond?.lines ?? []) : []),
    ];
    render(
      one(".runs-choice", side),
      runs.length === 0
        ? html``
        : runChoice(system, runs, alone(), { arrows: onMap.arrows, corrections: onMap.corrections.length }),
    );
    const open = one(".aids-choice", side).querySelector("details")?.open ?? false;
    render(
      one(".aids-choice", side),
      known?.state === "finished"
        ? html`${labChoice(runs, labRuns)}${aidsChoice(system, runs, computing, app.may("engineer"))}`
        : html``,
    );
    one(".aids-choice", side).querySelector("details")?.toggleAttribute("open", open);
    render(one(".walk-choice", side), own ? walkChoice(beside, others) : html``);
    const key = (/** @type {{ink: string, dash: number[]}} */ drawn, /** @type {string} */ words) =>
      html`<span
        ><svg class="long" viewBox="0 0 28 13" aria-hidden="true">
          <line
            class="run-sample"
            data-ink="${drawn.ink}"
            stroke-dasharray="${drawn.dash.join(" ")}"
            x1="1"
            y1="6.5"
            x2="27"
            y2="6.5"
          /></svg
        >${words}</span
      >`;
    render(
      one("#legend"),
      html`${shown.map((run) => key(run, runName(system, run, alone())))}${beside.map((walk) => key({ ink: walk.ink, dash: [] }, walk.name))}${(beyond?.legend ?? []).map(({ ink: name, words }) => key({ ink: name, dash: [] }, words))}
      ${onMap.arrows && onMap.corrections.length > 0 && key({ ink: "arrow", dash: [] }, t("session.run.arrows"))}`,
    );
    ink();
    app.layers.runs.invalidate();
  }

  /** What the system says of the moment of the cursor. */
  function showCard() {
    const card = one(".of-system", side);
    card.hidden = beyond === null;
    if (beyond) render(card, beyond.card(replay.now()));
  }

  /** @param {import("./track.js").Track} main */
  async function lookBeyond(main) {
    const found = await system.overlay?.(id, main).catch(() => null);
    if (gone || !found) return;
    beyond = found;
    showRuns();
    showCard();
    one(".session", side).dataset.beyond = "yes";
  }

  /** Canvas knows no style sheet, and an attribute no custom property. */
  function ink() {
    for (const sample of document.querySelectorAll(".run-sample"))
      sample.setAttribute("stroke", inkNamed(sample.getAttribute("data-ink") ?? ""));
  }

  /**
   * @param {string} name
   * @param {import("./track.js").TrackTable} table
   * @param {boolean} shown
   * @param {string} [words]
   */
  function addRun(name, table, shown, words) {
    const track = readTrack(table, system);
    const made = {
      name,
      words,
      ...drawnAs(name, runs.filter((run) => !isOwn(run.name)).length),
      track,
      length_m: pathLength(track),
      shown,
    };
    const at = runs.findIndex((run) => run.name === name);
    if (at >= 0) runs[at] = { ...made, ink: runs[at].ink, dash: runs[at].dash, shown: runs[at].shown };
    else runs.push(made);
    return track;
  }

  const rateOf = (/** @type {any} */ row) =>
    Math.min(MOST_RATE_HZ, Math.max(LEAST_RATE_HZ, Math.floor(ENOUGH_POINTS / Math.max(1, row.duration_s))));

  async function load() {
    try {
      const charted = replay.charts.load(true);
      [known, visits, anomalies, stands] = await asked.words;
      if (isUnknown(known)) await learnSystems(api);
      await openSystem(known.system);
      if (gone) return;
      if (systemOf(known) !== system) replay.setSystem((system = systemOf(known)));
      showWords();
      await showBoard();
      if (gone) return;
      if (known.state !== "finished" && !(known.epochs > 0)) {
        dock.hidden = true;
        return;
      }
      showMain(addRun("main", await asked.coarse, moment.runs?.includes("main") ?? true));
      const rate_hz = rateOf(known);
      charted.then(() => {
        if (!gone) one(".session", side).dataset.charted = "yes";
      });
      api.charts(id, null, MOST_SECONDS, ["rate"]).then(
        (found) => gone || render(one(".health", side), healthCard(system, healthOf(system, found.series, anomalies))),
        () => {},
      );
      if (rate_hz > LEAST_RATE_HZ) {
        const fine = await api.track(id, "main", rate_hz);
        if (gone) return;
        showMain(addRun("main", fine, true));
      }
      // What it is compared with is not waited for. A walk without a single visit, or one that was never worked out, has only one run.
      // One that places itself is the same without its visits.
      const others = STORED.slice(1).filter((run) => !(system.placesItself && run === "without_markers"));
      const more = await Promise.allSettled(others.map((run) => api.track(id, run, rate_hz)));
      if (gone) return;
      more.forEach((found, i) => {
        const name = others[i];
        if (found.status === "fulfilled" && found.value.rows.length > 0)
          addRun(name, found.value, moment.runs?.includes(name) ?? name === "without_markers");
      });
      showRuns();
      one(".session", side).dataset.compared = "yes";
      labRuns = await api.labRuns(id);
      if (gone) return;
      for (const name of moment.runs ?? [])
        if (!isOwn(name) && !runs.some((run) => run.name === name)) await compute(name);
      showRuns();
      for (const other of moment.beside) await addWalk(other);
    } catch (error) {
      if (!gone) trouble(error);
    }
  }

  /** What the system shows of the moment, where it has something of its own. */
  async function showBoard() {
    if (board || !system.board) return;
    const { makeBoard } = await system.board();
    if (gone) return;
    board = makeBoard(one(".board", side), {
      id,
      isLive: () => known?.state === "live" || known?.state === "created",
      instrument: known.instrument ?? null,
      posesUrl: api.feedUrl().replace(/feed$/, `sessions/${id}/poses`),
      charts: (stretch, buckets, names) => api.charts(id, stretch, buckets, names),
      anomalies: () => anomalies,
    });
  }

  /** @param {unknown} error */
  function trouble(error) {
    // What is known of the walk stays, also when its track cannot be had.
    const box = one(".trouble", side);
    box.hidden = false;
    render(box, problemBox(error));
  }

  /** @param {import("./track.js").Track} main */
  function showMain(main) {
    if (main.t_s.length === 0) return;
    const first = own === null;
    own = walkOf(id, known.title || nameOf(known), known.started_at, 0, "runA", main, visits);
    // What is held against a marker is not moved by it.
    onMap.corrections = system.placesItself ? [] : corrections(visits, (name) => app.grid.named(name));
    dock.hidden = false;
    if (first) app.stage.show(line(main));
    showRuns();
    replay.walksChanged();
    board?.show(main);
    lookBeyond(main);
    if (first) replay.seek(moment.t_s ?? (known.state === "live" ? Infinity : main.t_s[0]));
    one(".session", side).dataset.drawn = "yes";
  }

  /** A run of the laboratory, by chosen aids computed first where it is not there. @param {string} name */
  async function compute(name) {
    const aids = aidsOf(system, name);
    if (computing !== null) return;
    computing = name;
    showRuns();
    try {
      let run = runNamed(system, labRuns, name);
      if (!run && aids && app.may("engineer")) {
        run = await untilDone((await api.startLabRuns({ session_ids: [id], aids, solution: "filtered" }))[0].id);
        labRuns = await api.labRuns(id);
      }
      if (run && !gone) {
        const table = await api.labTrack(id, run.id, rateOf(known));
        if (gone) return;
        addRun(name, table, true, aids ? undefined : run.name);
      }
    } catch (error) {
      if (!gone) trouble(error);
    }
    computing = null;
    if (gone) return;
    showRuns();
    tellAddress();
  }

  /** @param {string} other */
  async function addWalk(other) {
    if (!own || other === id || beside.some((walk) => walk.id === other)) return;
    try {
      const row = await api.session(other);
      const [table, theirs] = await Promise.all([api.track(other, "main", rateOf(row)), api.visits(other)]);
      if (gone || table.rows.length === 0) return;
      const offset_s = (Date.parse(row.started_at) - own.started_ms) / 1000;
      beside.push(
        walkOf(
          other,
          row.title || nameOf(row),
          row.started_at,
          offset_s,
          OTHERS[beside.length % OTHERS.length],
          readTrack(table, systemOf(row)),
          theirs,
        ),
      );
      walksChanged();
    } catch (error) {
      if (!gone) trouble(error);
    }
  }

  function walksChanged() {
    showRuns();
    replay.walksChanged();
    tellAddress();
  }

  async function askForOthers() {
    if (others) return;
    others = [];
    const rows = await api.sessions().catch(() => []);
    others = rows
      .filter((/** @type {any} */ row) => row.id !== id && row.epochs > 0)
      .map((/** @type {any} */ row) => ({ ...row, name: row.title || nameOf(row) }));
    if (!gone) showRuns();
  }

  /** All that stands beside the map. */
  function showWords() {
    showHead(one(".head", side), known, nameOf(known), visits, system);
    showVisits(one(".visits", side), visits, app.writesFor(known.inspector_id), system);
    render(one(".clock-tie", side), clockCard(known.clock_tie, app.writesFor(known.inspector_id)));
    if (app.writesFor(known.inspector_id)) showCorrections();
    showStands();
    showAnomalies();
    render(one(".files", side), fileList(system, known));
    render(one(".residuals", side), residualCard(residualsOf(visits)));
    // A walk that was never processed has none.
    if (known.state === "finished")
      api.report(id).then(
        (report) => gone || render(one(".report", side), reportCard(system, report)),
        () => {},
      );
  }

  /** What only those need who may correct a walk comes when it is looked at. */
  async function showCorrections() {
    const [{ showPaper }, { showManage }] = await Promise.all([loadPaper(), loadManage()]);
    if (gone) return;
    const again = () => ask(Promise.resolve());
    showPaper(app, one(".paper", side), known, again);
    showManage(app, one("section.manage", side), known, again);
  }

  /** @param {unknown} [error] */
  function showStands(error) {
    const writes = known !== null && app.writesFor(known.inspector_id);
    render(
      one(".stands", side),
      html`<h2>${t("stand.title")}</h2>
        <label
          ><input
            type="checkbox"
            name="automatic"
            ${known?.automatic_visits && "checked"}
            ${!writes && "disabled"}
          />${t("stand.automatic")}</label
        >
        <p class="muted">${t("stand.automatic_hint")}</p>
        ${error !== undefined && problemBox(error)}
        ${stands.length === 0 ? html`<p class="muted">${t("stand.none")}</p>` : html`<div data-testid="stands">${standCards(stands, visits, writes)}</div>`}`,
    );
  }

  /**
   * Something was asked for that changes the visits; the track follows when its job has ended.
   * @param {Promise<unknown>} asked
   */
  async function ask(asked) {
    try {
      await asked;
      const [row, list, stood] = await Promise.all([api.session(id), api.visits(id), api.stands(id)]);
      if (gone) return;
      [known, visits, stands] = [row, list, stood];
      showWords();
    } catch (error) {
      if (!gone) showStands(error);
    }
  }

  function showAnomalies() {
    render(one(".anomalies", side), anomalyTable(system, anomalies));
  }

  const onClick = (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const asked = standClicked(target, id);
    if (asked) ask(asked);
    const taken = target.closest("[data-remove-visit]")?.getAttribute("data-remove-visit");
    if (taken) ask(api.takeVisitBack(id, taken));
    if (target.closest("[data-measure]")) ask(api.changeSession(id, { clock_offset_s: null }));
    const read = (/** @type {string} */ name) => target.closest(`[data-${name}]`)?.getAttribute(`data-${name}`);
    const [at, aids, remove, marker, lab] = [read("at"), read("aids"), read("remove"), read("visit"), read("lab")];
    if (at) replay.seek(Number(at));
    if (aids) compute(runByAids(system, aids.split("+")));
    if (lab) compute(lab);
    if (target.closest("[data-compute]")) {
      const chosen = [...side.querySelectorAll("input[name=aid]:checked")].map(
        (box) => /** @type {HTMLInputElement} */ (box).value,
      );
      if (chosen.length > 0) compute(runByAids(system, chosen));
    }
    if (remove) {
      beside = beside.filter((walk) => walk.id !== remove);
      walksChanged();
    }
    if (!marker) return;
    onMap.selected = marker;
    const place = app.grid.named(marker);
    if (place) app.stage.goTo([place.e_m, place.n_m], 2.5);
    app.layers.runs.invalidate();
  };
  const onChange = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    if (input.name === "automatic") ask(api.changeSession(id, { automatic_visits: input.checked }));
    if (input.name === "beside" && input.value) addWalk(input.value);
    if (input.name === "arrows") onMap.arrows = input.checked;
    for (const run of runs) if (input.name === "run" && run.name === input.value) run.shown = input.checked;
    if (input.name === "run" || input.name === "arrows") {
      showRuns();
      tellAddress();
    }
  };
  const onSubmit = (/** @type {Event} */ event) => {
    const form = /** @type {HTMLFormElement} */ (event.target);
    if (!form.matches("[data-clock-tie]")) return;
    event.preventDefault();
    const offset_s = askedOffset(form);
    if (offset_s !== null) ask(api.changeSession(id, { clock_offset_s: offset_s }));
  };
  const onFocus = (/** @type {Event} */ event) => {
    if (/** @type {HTMLElement} */ (event.target).closest("[name=beside]")) askForOthers();
  };
  side.addEventListener("click", onClick);
  side.addEventListener("change", onChange);
  side.addEventListener("focusin", onFocus);
  side.addEventListener("submit", onSubmit);
  lookAtJobs();
  load();
  showNote(app, one(".said", side), id);

  return {
    update(changed) {
      // The session was worked on: its end is worth a new look.
      if (changed.has("job") && lookAtJobs()) {
        asked = askAgain();
        load();
      } else if (known?.state === "live" && (changed.has("stand") || changed.has("visit"))) ask(Promise.resolve());
      if (known?.state === "live" && changed.has("position") && performance.now() - fetchedLive_ms > LIVE_MS) {
        fetchedLive_ms = performance.now();
        api.track(id, "main", rateOf(known)).then(
          (table) => gone || showMain(addRun("main", table, true)),
          () => {},
        );
        // Of a walk that goes on, the charts are made of all its samples anew.
        if (performance.now() - charted_ms > LIVE_CHARTS_MS) {
          charted_ms = performance.now();
          replay.charts.load(true);
        }
      }
      if (changed.has("all")) {
        // The inspectors' names come with the feed; the theme has other colours.
        if (known) showHead(one(".head", side), known, nameOf(known), visits, system);
        ink();
        replay.redraw();
      }
    },
    close() {
      gone = true;
      side.removeEventListener("click", onClick);
      side.removeEventListener("change", onChange);
      side.removeEventListener("focusin", onFocus);
      side.removeEventListener("submit", onSubmit);
      replay.close();
      board?.close();
      dock.remove();
      showAsBefore();
    },
  };
}

/** The colours of walks beside this one: those of people that are no run's. */
const OTHERS = ["7", "1", "6", "2"];
/** So many seconds are looked at one by one. */
const MOST_SECONDS = 5000;
