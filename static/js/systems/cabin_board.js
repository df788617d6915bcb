// The cabin's board beside the map: where cabin and platform are and should be, how sure that is, which aids correct it. Of a session
// that is streamed it listens to the poses, of one that is finished it shows the moment of the replay.

import { elapsed } from "../format.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { indexAt } from "../sessions/track.js";
import { STATES } from "./cabin.js";
import { changesOf, SOURCES, together } from "./cabin_changes.js";
import { drawDials, drawPlan } from "./cabin_drawing.js";
import { readFrame } from "./cabin_frame.js";
import { BODIES, BUDGETS_M, CHARTS, momentOf } from "./cabin_moment.js";
import { cellAt, drawAids, drawOffAngles, drawOffPlan, MINUTES } from "./cabin_times.js";
import { groupsOf, stationsOf, whyOut, wordOf } from "./cabin_why.js";

/** @typedef {import("./cabin_drawing.js").Past} Past */

const ANGLES = ["yaw", "pitch", "roll"];
/** Moments that are kept of the last minutes, and changes that are told. */
const MOMENTS = 600;
const CHANGES = 12;
const DRAWN_EVERY_MS = 200;
const AGAIN_AFTER_MS = 2000;
const SETTLED_MS = 250;

/**
 * @param {HTMLElement} host
 * @param {{
 *   id: string, isLive: () => boolean, instrument: string | null, posesUrl: string,
 *   charts: (stretch: [number, number], buckets: number, names: string[]) => Promise<any>,
 *   anomalies?: () => any[],
 * }} ways
 */
export function makeBoard(host, ways) {
  render(
    host,
    html`<h2>${t("cabin.board.title")}</h2>
      <dl data-testid="cabin-state"></dl>
      <h3>${t("cabin.board.plan")}</h3>
      <canvas class="plan"></canvas>
      <h3>${t("cabin.board.pose")}</h3>
      <canvas class="dials"></canvas>
      <h3>${t("cabin.board.off", { minutes: MINUTES })}</h3>
      <canvas class="off-0"></canvas>
      <canvas class="off-1"></canvas>
      <h3>${t("cabin.board.off_angles", { minutes: MINUTES })}</h3>
      <canvas class="angles-0"></canvas>
      <canvas class="angles-1"></canvas>
      <h3>${t("cabin.board.aids", { minutes: MINUTES })}</h3>
      <canvas class="aids"></canvas>
      <p class="why" data-testid="cabin-why"></p>
      <h3>${t("cabin.board.changes", { minutes: MINUTES })}</h3>
      <ol class="changes" data-testid="cabin-changes"></ol>`,
  );
  const canvas = (/** @type {string} */ name) => /** @type {HTMLCanvasElement} */ (one(".".concat(name), host));
  const stations = stationsOf(ways.instrument);
  const groups = groupsOf(ways.instrument);
  /** @type {string[]} */
  let names = [];
  /** The kinds of trouble by number. @type {string[]} */
  let troubles = [];
  /** @type {Past[]} */
  let past = [];
  /** @type {[number, number][]} */
  let trail = [];
  /** @type {[number, number][]} */
  let planned = [];
  /** @type {import("./cabin_frame.js").Frame | null} */
  let frame = null;
  let came_ms = 0;
  /** @type {import("../sessions/track.js").Track | null} */
  let track = null;
  let now_s = 0;
  /** @type {WebSocket | null} */
  let socket = null;
  let gone = false;
  let drawn_ms = 0;
  let waiting = 0;

  /** Live: the newest pose, as it comes. */
  function listen() {
    if (gone || !ways.isLive()) return;
    socket = new WebSocket(ways.posesUrl);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") ({ aids: names = [], troubles = [] } = JSON.parse(data));
      else take(readFrame(data));
    };
    socket.onclose = () => {
      if (!gone) waiting = window.setTimeout(listen, AGAIN_AFTER_MS);
    };
  }

  /** @param {import("./cabin_frame.js").Frame | null} next */
  function take(next) {
    if (!next) return;
    [frame, now_s, came_ms] = [next, next.t_s, performance.now()];
    if (past.length === 0 || next.t_s - past[past.length - 1].t_s >= (MINUTES * 60) / MOMENTS) {
      const aids = names.map((_, bit) => ((next.aids >> BigInt(bit)) & 1n) === 1n);
      const platform = next.bodies[1];
      const measuredBy = aids[names.indexOf("encoders")] ? 1 : 2;
      past.push({
        t_s: next.t_s,
        state: next.state,
        source: platform ? (platform.measured ? measuredBy : 3) : null,
        aids,
        off_m: next.bodies.map((body) => body && body.off_m),
        sigma_m: next.bodies.map((body) => body && Math.max(...body.sigma_m)),
        off_rad: next.bodies.map((body) => body && body.off_rad),
        sigma_rad: next.bodies.map((body) => body && Math.max(...body.sigma_rad)),
      });
      if (past.length > MOMENTS) past.shift();
      const cabin = next.bodies[0];
      if (cabin) {
        trail.push([cabin.place_m[0], cabin.place_m[1]]);
        if (Number.isFinite(cabin.off_m[0]))
          planned.push([cabin.place_m[0] - cabin.off_m[0], cabin.place_m[1] - cabin.off_m[1]]);
      }
    }
    if (came_ms - drawn_ms > DRAWN_EVERY_MS) draw();
  }

  /** What the figures say of a body. @param {number} k */
  function figures(k) {
    const body = frame?.bodies[k];
    if (!body)
      return html`<dt>${t(`cabin.board.${BODIES[k]}`)}</dt>
        <dd>–</dd>`;
    const limit = { limit: BUDGETS_M[k] * 1000 };
    const words = body.alarm ? t("cabin.board.alarm", limit) : body.near ? t("cabin.board.near", limit) : "";
    const mm = (/** @type {number} */ m) => (Number.isFinite(m) ? `${(1000 * m).toFixed(1)} mm` : "–");
    return html`<dt>${t(`cabin.board.${BODIES[k]}`)}</dt>
      <dd>
        <span>${t("cabin.board.sigma")} <b class="big">${mm(Math.max(...body.sigma_m))}</b></span>
        <span>${t("cabin.board.level")} ${mm(body.level_m)}</span>
        ${
          Number.isFinite(body.left_s) &&
          html`<span>${t("cabin.board.left")} <b class="big">${body.left_s.toFixed(0)} s</b></span>`
        }
        ${!body.measured && html`<span>${t("cabin.board.held")}</span>`}
        ${words && html`<strong data-testid="cabin-alarm">${words}</strong>`}
      </dd>`;
  }

  /** The devices that are not in, and why: of a stream as the pose tells it, of a finished run by what was found out. */
  function out() {
    const last = past.at(-1);
    if (!last || !frame) return [];
    const found = ways.anomalies?.() ?? [];
    return names
      .map((name, k) => ({ name, k }))
      .filter(({ k }) => !last.aids[k])
      .map(({ name, k }) => {
        const state = frame?.states[k];
        if (!state) return whyOut(found, groups, { name, t_s: now_s });
        const since = Number.isFinite(state.since_s) ? [`${state.since_s.toFixed(1)} s`] : [];
        const why = state.trouble > 0 ? [wordOf(troubles[state.trouble - 1] ?? "")] : [];
        return [name, ...why, ...since].join(" · ");
      });
  }

  function draw() {
    drawn_ms = performance.now();
    const age_s = frame ? frame.age_s + (ways.isLive() ? (drawn_ms - came_ms) / 1000 : 0) : null;
    const silent = age_s !== null && age_s > 1;
    const state = frame ? STATES[silent ? 4 : frame.state] : null;
    const missing = out();
    render(
      one("dl", host),
      html`<dt>${t("cabin.board.state")}</dt>
        <dd>
          <strong class="big">${state === null ? t("cabin.board.nothing") : t(`cabin.state.${state}`)}</strong>
        </dd>
        ${
          ways.isLive() &&
          age_s !== null &&
          html`<dt>${t("cabin.board.age")}</dt>
            <dd><b class="big">${(1000 * age_s).toFixed(0)} ms</b></dd>`
        }
        ${figures(0)}${figures(1)}
        ${
          missing.length > 0 &&
          html`<dt>${t("cabin.board.out")}</dt>
            <dd data-testid="cabin-out">${missing.map((words) => html`<span>${words}</span>`)}</dd>`
        }
        ${
          planned.length === 0 &&
          html`<dt>${t("cabin.stream.plan")}</dt>
            <dd>${t("cabin.board.no_plan")}</dd>`
        }`,
    );
    const bodies = frame?.bodies ?? [null, null];
    const picture = { bodies, trail, planned, past, now_s, names, stations };
    const angles = ANGLES.map((angle) => t(`cabin.board.${angle}`));
    drawPlan(canvas("plan"), picture);
    drawDials(canvas("dials"), bodies, angles);
    BODIES.forEach((body, k) => {
      drawOffPlan(canvas(`off-${k}`), picture, k, t(`cabin.board.${body}`));
      drawOffAngles(canvas(`angles-${k}`), picture, k, t(`cabin.board.${body}`), angles);
    });
    drawAids(canvas("aids"), picture, [t("cabin.board.state"), t("cabin.board.platform"), ...names]);
    const changes = changesOf(past, names, CHANGES);
    const lines = changes.map((change) => ({ when: elapsed(change.t_s), words: wordsOf(change) }));
    const told = lines.length > 0 ? lines : [{ when: "", words: t("cabin.board.no_change") }];
    render(
      one(".changes", host),
      html`${told.map(({ when, words }) => html`<li><span class="when">${when}</span> ${words}</li>`)}`,
    );
    host.dataset.drawn = "yes";
  }

  /** The moment of the replay, and the minutes before it. */
  async function look() {
    const at_s = now_s;
    const found = await ways.charts([Math.max(0, at_s - MINUTES * 60), at_s + 0.2], MOMENTS, CHARTS).catch(() => null);
    if (gone || !found || !track || at_s !== now_s || ways.isLive()) return;
    ({ names, past, frame } = momentOf(found, track, at_s));
    trail = Array.from(track.e_m, (e, k) => /** @type {[number, number]} */ ([e, track?.n_m[k] ?? NaN]));
    planned = past.flatMap(({ t_s, off_m }) => {
      if (!track || !off_m[0]) return [];
      const k = indexAt(track, t_s);
      return [/** @type {[number, number]} */ ([track.e_m[k] - off_m[0][0], track.n_m[k] - off_m[0][1]])];
    });
    draw();
  }

  // A cell tells why its device was shut out, where somebody points at it or touches it.
  const tell = (/** @type {PointerEvent} */ { offsetX, offsetY }) => {
    const cell = cellAt(canvas("aids"), { rows: ["", "", ...names], now_s }, offsetX, offsetY);
    const words = cell?.name ? `${elapsed(cell.t_s)} ${whyOut(ways.anomalies?.() ?? [], groups, cell)}` : "";
    canvas("aids").title = words;
    one(".why", host).textContent = words;
  };
  canvas("aids").addEventListener("pointermove", tell);
  canvas("aids").addEventListener("pointerdown", tell);
  listen();
  draw();
  // What was drawn while another tab was open has no width yet.
  const resized = new ResizeObserver(() => draw());
  resized.observe(host);
  return {
    /** @param {import("../sessions/track.js").Track} found */
    show(found) {
      track = found;
      if (!ways.isLive()) this.seek(now_s || found.t_s[0] || 0);
    },
    /** @param {number} t_s */
    seek(t_s) {
      if (ways.isLive()) return;
      now_s = t_s;
      window.clearTimeout(waiting);
      waiting = window.setTimeout(look, SETTLED_MS);
    },
    close() {
      gone = true;
      resized.disconnect();
      window.clearTimeout(waiting);
      socket?.close();
    },
  };
}

/** @param {import("./cabin_changes.js").Change} change */
function wordsOf({ gone, back, state, source }) {
  const words = [
    ...(gone.length > 0 ? [t("cabin.board.gone", { names: together(gone) })] : []),
    ...(back.length > 0 ? [t("cabin.board.back", { names: together(back) })] : []),
    ...(source !== null ? [t(`cabin.board.source.${SOURCES[source] ?? SOURCES[0]}`)] : []),
    ...(state !== null ? [t(`cabin.state.${STATES[state] ?? STATES[0]}`)] : []),
  ];
  return words.join(" · ");
}
