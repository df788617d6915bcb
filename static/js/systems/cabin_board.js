// The cabin's board beside the map: where cabin and platform are and should be, how sure that is, which aids correct it. Of a session
// that is streamed it listens to the poses, of one that is finished it shows the moment of the replay.

import { html, one, render } from "../html.js";
import { has, t } from "../i18n.js";
import { STATES } from "./cabin.js";
import { aidAt, drawAids, drawDials, drawOffPlan, drawPlan } from "./cabin_drawing.js";
import { readFrame } from "./cabin_frame.js";
import { indexAt } from "../sessions/track.js";

/** @typedef {import("./cabin_drawing.js").Past} Past */

const BODIES = ["cabin", "platform"];
const AXES = ["e", "n", "u"];
const BUDGETS_M = [0.015, 0.003];
const MINUTES = 10;
/** Moments that are kept of the last minutes. */
const MOMENTS = 600;
const CHARTS = ["off_plan", "sigma_body", "protection_level", "aids", "state", "time_left", "platform_yaw"];
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
      <h3>${t("cabin.board.off")}</h3>
      <canvas class="off-0"></canvas>
      <canvas class="off-1"></canvas>
      <h3>${t("cabin.board.aids", { minutes: MINUTES })}</h3>
      <canvas class="aids"></canvas>`,
  );
  const canvas = (/** @type {string} */ name) => /** @type {HTMLCanvasElement} */ (one(".".concat(name), host));
  const stations = stationsOf(ways.instrument);
  /** @type {string[]} */
  let names = [];
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
      if (typeof data === "string") names = JSON.parse(data).aids ?? [];
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
      past.push({
        t_s: next.t_s,
        off_m: next.bodies.map((body) => body && body.off_m),
        sigma_m: next.bodies.map((body) => body && Math.max(...body.sigma_m)),
        aids: names.map((_, bit) => ((next.aids >> BigInt(bit)) & 1n) === 1n),
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
        <span>${t("cabin.board.sigma")} ${mm(Math.max(...body.sigma_m))}</span>
        <span>${t("cabin.board.level")} ${mm(body.level_m)}</span>
        ${Number.isFinite(body.left_s) && html`<span>${t("cabin.board.left")} ${body.left_s.toFixed(0)} s</span>`}
        ${!body.measured && html`<span>${t("cabin.board.held")}</span>`}
        ${words && html`<strong data-testid="cabin-alarm">${words}</strong>`}
      </dd>`;
  }

  function draw() {
    drawn_ms = performance.now();
    const age_s = frame ? frame.age_s + (ways.isLive() ? (drawn_ms - came_ms) / 1000 : 0) : null;
    const silent = age_s !== null && age_s > 1;
    const state = frame ? STATES[silent ? 4 : frame.state] : null;
    render(
      one("dl", host),
      html`<dt>${t("cabin.board.state")}</dt>
        <dd><strong>${state === null ? t("cabin.board.nothing") : t(`cabin.state.${state}`)}</strong></dd>
        ${
          ways.isLive() &&
          age_s !== null &&
          html`<dt>${t("cabin.board.age")}</dt>
            <dd>${(1000 * age_s).toFixed(0)} ms</dd>`
        }
        ${figures(0)}${figures(1)}
        ${
          planned.length === 0 &&
          html`<dt>${t("cabin.stream.plan")}</dt>
            <dd>${t("cabin.board.no_plan")}</dd>`
        }`,
    );
    const bodies = frame?.bodies ?? [null, null];
    const picture = { bodies, trail, planned, past, now_s, names, stations };
    drawPlan(canvas("plan"), picture);
    drawDials(
      canvas("dials"),
      bodies,
      ["yaw", "pitch", "roll"].map((angle) => t(`cabin.board.${angle}`)),
    );
    BODIES.forEach((body, k) => drawOffPlan(canvas(`off-${k}`), picture, k, t(`cabin.board.${body}`)));
    drawAids(canvas("aids"), picture);
    host.dataset.drawn = "yes";
  }

  /** The moment of the replay, and the minutes before it. */
  async function look() {
    const at_s = now_s;
    const found = await ways.charts([Math.max(0, at_s - MINUTES * 60), at_s + 0.2], MOMENTS, CHARTS).catch(() => null);
    if (gone || !found || !track || at_s !== now_s || ways.isLive()) return;
    /** @param {string} chart @param {string} series @param {number} t_s @returns {number | null} */
    const value = (chart, series, t_s) => {
      const line = found.series.find((/** @type {any} */ one) => one.chart === chart && one.series === series);
      return line ? (line.low[Math.floor((t_s - line.start_s) / line.step_s + 1e-6)] ?? null) : null;
    };
    const off = (/** @type {string} */ body, /** @type {number} */ t_s) => {
      const axes = AXES.map((axis) => value("off_plan", `${body}_${axis}`, t_s));
      return axes.every((mm) => mm !== null) ? /** @type {number[]} */ (axes) : null;
    };
    const aids = found.series.filter((/** @type {any} */ line) => line.chart === "aids");
    names = aids.map((/** @type {any} */ line) => line.series).toSorted(byKind);
    const some = found.series.find((/** @type {any} */ line) => line.chart === "sigma_body");
    const times = some
      ? some.low.map((/** @type {unknown} */ _, /** @type {number} */ i) => some.start_s + (i + 0.5) * some.step_s)
      : [];
    past = times.map((/** @type {number} */ t_s) => ({
      t_s,
      off_m: BODIES.map((body) => off(body, t_s)),
      sigma_m: BODIES.map((body) => value("sigma_body", body, t_s)),
      aids: names.map((name) => (value("aids", name, t_s) ?? 0) > 0.5),
    }));
    const last_s = times.at(-1) ?? at_s;
    const i = indexAt(track, at_s);
    const { more } = track;
    const places = [
      [track.e_m[i], track.n_m[i], track.u_m[i]],
      [more.platform_e_m[i], more.platform_n_m[i], more.platform_u_m[i]],
    ];
    const angles = [
      [track.heading_rad[i], more.pitch_rad[i], more.roll_rad[i]],
      [value("platform_yaw", "platform", last_s) ?? NaN, NaN, NaN],
    ];
    frame = {
      t_s: at_s,
      age_s: 0,
      state: Math.round(value("state", "cabin", last_s) ?? 0),
      aids: 0n,
      bodies: BODIES.map((body, k) => {
        if (!Number.isFinite(places[k][0])) return null;
        const level_m = value("protection_level", body, last_s) ?? NaN;
        const sigma_m = value("sigma_body", body, last_s) ?? NaN;
        return {
          place_m: places[k],
          angles_rad: angles[k],
          sigma_m: [sigma_m],
          off_m: off(body, last_s) ?? [NaN, NaN, NaN],
          level_m,
          left_s: value("time_left", body, last_s) ?? NaN,
          valid: true,
          measured: true,
          alarm: 3 * sigma_m > BUDGETS_M[k],
          near: 3 * sigma_m > 0.8 * BUDGETS_M[k],
        };
      }),
    };
    trail = Array.from(track.e_m, (e, k) => /** @type {[number, number]} */ ([e, track?.n_m[k] ?? NaN]));
    planned = past.flatMap(({ t_s, off_m }) => {
      if (!track || !off_m[0]) return [];
      const k = indexAt(track, t_s);
      return [/** @type {[number, number]} */ ([track.e_m[k] - off_m[0][0], track.n_m[k] - off_m[0][1]])];
    });
    draw();
  }

  // A cell of the aids tells why its device was shut out, where somebody points at it.
  canvas("aids").addEventListener("pointermove", ({ offsetX, offsetY }) => {
    const cell = aidAt(canvas("aids"), { names, now_s }, offsetX, offsetY);
    canvas("aids").title = cell ? whyOut(ways.anomalies?.() ?? [], cell) : "";
  });
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

/** Anomalies of all devices of a kind are those of each. */
const GROUPS = /** @type {[RegExp, string][]} */ ([
  [/^S\d/, "stations"],
  [/^A\d/, "antennas"],
]);

/**
 * What was wrong with a device at a time, by the words of its kinds; its name alone where nothing was.
 * @param {any[]} anomalies
 * @param {{name: string, t_s: number}} cell
 */
export function whyOut(anomalies, { name, t_s }) {
  const group = GROUPS.find(([pattern]) => pattern.test(name))?.[1];
  const words = anomalies
    .filter(({ figures, detail }) => {
      const device = figures?.device ?? String(detail).split(":")[0];
      return device === name || device === group;
    })
    .filter(({ t_start_ns, t_end_ns }) => t_start_ns / 1e9 <= t_s + 0.5 && t_s - 0.5 <= t_end_ns / 1e9)
    .map(({ anomaly }) => (has(`cabin.anomaly.${anomaly}`) ? t(`cabin.anomaly.${anomaly}`) : anomaly));
  return [name, ...new Set(words)].join(" · ");
}

/** The inertial sensor first, then antennas, stations, encoders. @param {string} a @param {string} b */
function byKind(a, b) {
  const order = (/** @type {string} */ name) => (name === "imu" ? 0 : name === "encoders" ? 2 : 1);
  return order(a) - order(b) || a.localeCompare(b, "en", { numeric: true });
}

/**
 * Names and places of the stations in the instrument's file.
 * @param {string | null} instrument
 */
export function stationsOf(instrument) {
  const section = (instrument ?? "").split(/^\[stations\]/m)[1]?.split(/^\[\w/m)[0] ?? "";
  const names = [...(section.match(/names\s*=\s*\[([^\]]*)\]/)?.[1] ?? "").matchAll(/"([^"]*)"/g)].map((m) => m[1]);
  const list = section.match(/position_n\s*=\s*\[([\s\S]*?)\]\s*(?:#.*)?\n\s*[\]\w]/)?.[0] ?? "";
  const places = [...list.matchAll(/\[\s*([-+.\deE]+)\s*,\s*([-+.\deE]+)\s*,/g)];
  return places.slice(0, names.length).map(([, e, n], k) => ({ name: names[k], e_m: Number(e), n_m: Number(n) }));
}
