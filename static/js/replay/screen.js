// The replay of a walk, and of others beside it: one clock for the time bar, the charts and the map.

import * as api from "../api.js";
import { clock as timeOfDay, elapsed } from "../format.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { inkNamed } from "../map/ink.js";
import { eastNorth } from "../map/stage.js";
import { visitTime } from "../state/findings.js";
import { problemBox } from "../ui/problem.js";
import { makeCharts } from "./charts.js";
import { Clock, SPEEDS, gapsOf, inAll } from "./clock.js";
import { makeKeys } from "./keys.js";
import { readoutFigures, showReadout } from "./readout.js";
import { makeTimeBar } from "./time_bar.js";
import { nearestIndex, placeAt } from "../sessions/track.js";

/** A track with so little in it has a gap, s. */
const GAP_S = 2;
/** The address follows the cursor, not more often than this, ms. */
const ADDRESS_MS = 400;
/** A stretch of the track around the cursor is fetched point by point when the cursor rests, s. */
const DETAIL_S = 30;

/**
 * @typedef {import("../sessions/track.js").Track} Track
 * @typedef {{
 *   id: string, name: string, started_ms: number, offset_s: number, ink: string, track: Track, gaps: import("./clock.js").Stretch[],
 *   visits: import("../state/findings.js").Visit[],
 * }} Walk `offset_s`: when it began, on the clock of the walk that the screen is about
 */

/**
 * @param {string} id
 * @param {string} name
 * @param {string} started_at
 * @param {number} offset_s
 * @param {string} ink
 * @param {Track} track
 * @param {import("../state/findings.js").Visit[]} visits
 * @returns {Walk}
 */
export function walkOf(id, name, started_at, offset_s, ink, track, visits) {
  return { id, name, started_ms: Date.parse(started_at), offset_s, ink, track, visits, gaps: gapsOf(track.t_s, GAP_S) };
}

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} dock
 * @param {string} id of the walk that the screen is about
 * @param {import("../systems/index.js").System} system
 * @param {{
 *   runs: import("../map/runs.js").Runs, walks: () => Walk[], moved: (t_s: number) => void,
 *   visits: () => import("../state/findings.js").Visit[], isLive: () => boolean,
 *   detail: (from_s: number, to_s: number) => Promise<Track>,
 * }} ways `walks`: the screen's own first
 */
export function makeReplay(app, dock, id, system, ways) {
  const clock = new Clock();
  render(
    dock,
    html`<div class="transport">
        <button type="button" data-do="back" data-t-label="sessions.replay.marker_before">
          <svg viewBox="0 0 20 20" aria-hidden="true"><path d="M5 4V16M15 4 7 10 15 16Z" /></svg>
        </button>
        <button type="button" data-do="play" class="main-action" data-testid="play" data-t-label="sessions.replay.play">
          <svg viewBox="0 0 20 20" aria-hidden="true">
            <path class="to-play" d="M6 3 16 10 6 17Z" />
            <path class="to-pause" d="M6 4H8V16H6ZM12 4H14V16H12Z" />
          </svg>
        </button>
        <button type="button" data-do="on" data-t-label="sessions.replay.marker_next">
          <svg viewBox="0 0 20 20" aria-hidden="true"><path d="M15 4V16M5 4 13 10 5 16Z" /></svg>
        </button>
        <select data-t-label="sessions.replay.speed" data-testid="speed">
          ${SPEEDS.map((speed) => html`<option value="${String(speed)}">${String(speed)}×</option>`)}
        </select>
        <button type="button" data-do="loop_from" data-t-label="sessions.replay.loop_from">A</button
        ><button type="button" data-do="loop_to" data-t-label="sessions.replay.loop_to">B</button>
        <button type="button" data-do="loop_off" data-t="sessions.replay.loop_off" hidden></button>
        <label><input type="checkbox" name="skip" checked /><span data-t="sessions.replay.skip_gaps"></span></label>
        <label><input type="checkbox" name="follow" /><span data-t="map.follow"></span></label>
        <button type="button" data-do="live" data-t="sessions.replay.live" hidden></button>
      </div>
      <canvas class="replay-bar" role="slider" tabindex="0" data-t-label="session.time" data-testid="time-bar"></canvas>
      <dl class="replay-readout" data-testid="readout">${readoutFigures(system)}</dl>
      <div class="chart-problem" hidden></div>
      <div class="chart-room"></div>`,
  );
  const speed = /** @type {HTMLSelectElement} */ (one("select", dock));
  const play = one("[data-do=play]", dock);
  const follow = /** @type {HTMLInputElement} */ (one("[name=follow]", dock));
  speed.value = String(clock.speed);

  const charts = makeCharts(one(".chart-room", dock), system, {
    fetch: (stretch, buckets, names) => api.charts(id, stretch, buckets, names),
    seek,
    select: (a_s, b_s) => setLoop(a_s, b_s),
    viewChanged: () => bar.draw(),
    loaded() {
      bar.draw();
      showFigures();
    },
    failed(error) {
      const box = one(".chart-problem", dock);
      box.hidden = false;
      render(box, problemBox(error));
    },
    dots: (plot) => {
      if (plot.visits)
        return ways
          .visits()
          .filter((v) => v.nis !== undefined && v.nis !== null)
          .map((v) => ({ t_s: visitTime(v), value: Number(v.nis), bad: !v.accepted }));
      if (!plot.heights) return [];
      return ways.visits().flatMap((v) => {
        const u_m = app.grid.named(v.marker)?.u_m;
        return u_m === undefined || u_m === null ? [] : [{ t_s: visitTime(v), value: u_m, bad: v.accepted === false }];
      });
    },
  });
  const bar = makeTimeBar(/** @type {HTMLCanvasElement} */ (one(".replay-bar", dock)), clock, {
    lanes: () =>
      ways.walks().map((walk) => {
        const at = (/** @type {number} */ s) => s + walk.offset_s;
        const { t_s } = walk.track;
        return {
          from_s: at(t_s[0] ?? 0),
          to_s: at(t_s[t_s.length - 1] ?? 0),
          colour: inkNamed(walk.ink),
          gaps: walk.gaps.map(([a, b]) => /** @type {import("./clock.js").Stretch} */ ([at(a), at(b)])),
          marks: walk.visits.map((v) => ({ t_s: at(visitTime(v)), bad: v.accepted === false })),
        };
      }),
    view: charts.view,
    seek,
    select: (a_s, b_s) => setLoop(a_s, b_s),
    said: () => `${elapsed(clock.t_s)}, ${timeOfDay(own().started_ms + clock.t_s * 1000)}`,
  });
  charts.setLoop(() => clock.loop);

  let frame = 0;
  let then_ms = 0;
  let addressed = 0;
  let resting = 0;
  /** @type {Track | null} every point around the cursor */
  let detail = null;
  const own = () => ways.walks()[0];

  /** @param {number} t_s */
  function seek(t_s) {
    if (!own()) return;
    clock.seek(t_s);
    showMoment();
  }

  /** Everything that depends on the cursor. */
  function showMoment() {
    const walks = ways.walks();
    if (walks.length === 0) return;
    charts.moveCursor(clock.t_s);
    bar.draw();
    const alone = walks.length === 1;
    ways.runs.cursors = walks.flatMap((walk) => {
      const t_s = clock.t_s - walk.offset_s;
      const last_s = walk.track.t_s[walk.track.t_s.length - 1];
      if (walk !== walks[0] && (t_s < walk.track.t_s[0] || t_s > last_s)) return [];
      const close =
        walk === walks[0] && detail && t_s >= detail.t_s[0] && t_s <= detail.t_s[detail.t_s.length - 1]
          ? detail
          : walk.track;
      return [
        { place: placeAt(close, t_s), ink: walk === walks[0] ? "accent" : walk.ink, label: alone ? "" : walk.name },
      ];
    });
    app.layers.runs.invalidate();
    if (follow.checked && ways.runs.cursors.length > 0) app.stage.keepInView(ways.runs.cursors[0].place);
    showFigures();
    showState();
    clearTimeout(addressed);
    addressed = window.setTimeout(() => ways.moved(clock.t_s), ADDRESS_MS);
    if (clock.state === "paused") lookCloser();
  }

  function showFigures() {
    const walk = own();
    if (walk)
      showReadout(dock, app, { system, walk, detail, t_s: clock.t_s, line: charts.line, visits: ways.visits() });
  }

  /** What is stored of the track near the cursor, for figures that are not between two points. */
  function lookCloser() {
    clearTimeout(resting);
    const t_s = clock.t_s;
    if (detail && t_s >= detail.t_s[0] && t_s <= detail.t_s[detail.t_s.length - 1]) return;
    resting = window.setTimeout(async () => {
      const found = await ways.detail(Math.max(0, t_s - DETAIL_S), t_s + DETAIL_S).catch(() => null);
      if (!found || found.t_s.length < 2 || resting === -1) return;
      detail = found;
      if (t_s >= found.t_s[0] && t_s <= found.t_s[found.t_s.length - 1]) showMoment();
    }, ADDRESS_MS);
  }

  function showState() {
    const words = t(clock.state === "paused" ? "sessions.replay.play" : "sessions.replay.pause");
    play.setAttribute("aria-label", words);
    play.setAttribute("title", words);
    dock.dataset.state = clock.state;
    speed.value = String(clock.speed);
    one("[data-do=loop_off]", dock).hidden = clock.loop === null;
    const live = one("[data-do=live]", dock);
    live.hidden = !ways.isLive();
    live.setAttribute("aria-pressed", String(clock.state === "live"));
  }

  function run() {
    cancelAnimationFrame(frame);
    if (clock.state !== "playing") return;
    then_ms = performance.now();
    const step = (/** @type {number} */ now_ms) => {
      if (clock.advance(Math.max(0, now_ms - then_ms) / 1000)) showMoment();
      then_ms = now_ms;
      if (clock.state === "playing") frame = requestAnimationFrame(step);
      else showMoment();
    };
    frame = requestAnimationFrame(step);
  }

  /**
   * @param {number | null} a_s
   * @param {number} [b_s]
   */
  function setLoop(a_s, b_s) {
    clock.setLoop(a_s, b_s);
    showState();
    bar.draw();
  }

  const actions = {
    toggle() {
      clock.toggle();
      showMoment();
      run();
    },
    step: (/** @type {number} */ by_s) => seek(clock.t_s + by_s),
    /** To the next visit, or the one before. @param {number} by */
    marker(by) {
      const times = ways
        .visits()
        .map(visitTime)
        .sort((a, b) => a - b);
      const found = by > 0 ? times.find((s) => s > clock.t_s + 0.05) : times.findLast((s) => s < clock.t_s - 0.05);
      if (found !== undefined) seek(found);
    },
    speed(/** @type {number} */ by) {
      clock.changeSpeed(by);
      showState();
    },
    toStart: () => seek(clock.from_s),
    toEnd: () => seek(clock.to_s),
    live() {
      if (!ways.isLive()) return;
      clock.goLive();
      showMoment();
    },
    follow() {
      follow.checked = !follow.checked;
      showMoment();
    },
    loopFrom: () => setLoop(clock.t_s, clock.loop && clock.loop[1] > clock.t_s ? clock.loop[1] : clock.to_s),
    loopTo: () => setLoop(clock.loop && clock.loop[0] < clock.t_s ? clock.loop[0] : clock.from_s, clock.t_s),
  };
  const stopKeys = makeKeys(actions);
  dock.addEventListener("click", (event) => {
    const asked = /** @type {HTMLElement} */ (event.target).closest("[data-do]")?.getAttribute("data-do");
    if (asked === "play") actions.toggle();
    if (asked === "back") actions.marker(-1);
    if (asked === "on") actions.marker(1);
    if (asked === "loop_from") actions.loopFrom();
    if (asked === "loop_to") actions.loopTo();
    if (asked === "loop_off") setLoop(null);
    if (asked === "live") actions.live();
  });
  speed.addEventListener("change", () => {
    clock.speed = Number(speed.value);
    speed.blur();
  });
  dock.addEventListener("change", (event) => {
    const box = /** @type {HTMLInputElement} */ (event.target);
    if (box.name === "skip") clock.skipGaps = box.checked;
    if (box.name === "follow") showMoment();
  });
  const onMapClick = (/** @type {L.LeafletMouseEvent} */ event) => {
    const reach_m = 14 / 2 ** app.stage.map.getZoom();
    for (const walk of ways.walks()) {
      const i = nearestIndex(walk.track, eastNorth(event.latlng), reach_m);
      if (i !== null) return seek(walk.track.t_s[i] + walk.offset_s);
    }
  };
  app.stage.map.on("click", onMapClick);
  translate(dock);

  return {
    seek,
    now: () => clock.t_s,
    charts,
    /** The walk has proved to be of another system. @param {import("../systems/index.js").System} other */
    setSystem(other) {
      system = other;
      render(one(".replay-readout", dock), readoutFigures(system));
      charts.setSystem(system);
      charts.load(true);
    },
    /** Walks have come, gone or grown. */
    walksChanged() {
      const walks = ways.walks().filter((walk) => walk.track.t_s.length > 0);
      if (walks.length === 0) return;
      const ends = walks.map((walk) => [
        walk.track.t_s[0] + walk.offset_s,
        walk.track.t_s[walk.track.t_s.length - 1] + walk.offset_s,
      ]);
      const first = clock.to_s === 0;
      detail = null;
      clock.gaps = inAll(
        walks.map((walk, i) =>
          [
            [-Infinity, ends[i][0]],
            ...walk.gaps.map(([a, b]) => [a + walk.offset_s, b + walk.offset_s]),
            [ends[i][1], Infinity],
          ].map(([a, b]) => /** @type {import("./clock.js").Stretch} */ ([a, b])),
        ),
      ).filter(([a, b]) => Number.isFinite(a) && Number.isFinite(b));
      clock.setSpan(Math.min(...ends.map(([a]) => a)), Math.max(...ends.map(([, b]) => b)));
      if (first && ways.isLive()) clock.goLive();
      charts.setSpan(ends[0][0], ends[0][1]);
      showMoment();
    },
    redraw() {
      charts.draw();
      bar.draw();
      showMoment();
    },
    close() {
      stopKeys();
      cancelAnimationFrame(frame);
      clearTimeout(addressed);
      clearTimeout(resting);
      resting = -1;
      bar.close();
      charts.close();
      app.stage.map.off("click", onMapClick);
    },
  };
}
