// What is so at the cursor, in figures: always the same ones, always in the same place.

import { clock as timeOfDay, duration, elapsed, heading, length, number } from "../format.js";
import { html, one, setText } from "../html.js";
import { visitTime } from "../state/findings.js";
import { indexAt, placeAt } from "../sessions/track.js";
import { word } from "../systems/index.js";
import { valueAt } from "./lines.js";

/** An actuator is named when it is within this, m. */
const NEAR_M = 40;

/** The cursor may be this far beyond the ends of a walk and still mean its end, s. */
const LEAVE_S = 1;

/** @param {import("../systems/index.js").System} system */
const figures = ({ readouts }) => [
  ...["time", "clock", "e", "n", "u", "sigma", "speed", "heading"],
  ...readouts.map(({ name }) => name),
  ...["marker", "near"],
];

/** @param {import("../systems/index.js").System} system */
export function readoutFigures(system) {
  const own = new Set(system.readouts.map(({ name }) => name));
  return html`${figures(system).map(
    (name) =>
      html`<div>
        <dt>${word(system, `readout.${name}`)}</dt>
        <dd class="mono" data-figure="${name}" ${own.has(name) && "data-of-system"}>–</dd>
      </div>`,
  )}`;
}

/**
 * @param {HTMLElement} dock
 * @param {import("../app.js").App} app
 * @param {{
 *   system: import("../systems/index.js").System, walk: import("./screen.js").Walk,
 *   detail: import("../sessions/track.js").Track | null, t_s: number,
 *   line: (chart: string, series: string) => import("./lines.js").Line | undefined, visits: import("../state/findings.js").Visit[],
 * }} moment
 */
export function showReadout(dock, app, { system, walk, detail, t_s, line, visits }) {
  const close = detail !== null && t_s >= detail.t_s[0] && t_s <= detail.t_s[detail.t_s.length - 1];
  const track = close ? detail : walk.track;
  if (track.t_s.length === 0) return;
  const show = (/** @type {string} */ name, /** @type {string} */ words) =>
    setText(one(`[data-figure=${name}]`, dock), words);
  if (t_s < walk.track.t_s[0] - LEAVE_S || t_s > walk.track.t_s[walk.track.t_s.length - 1] + LEAVE_S) {
    // Another walk goes on, or has begun, without this one.
    figures(system)
      .slice(2)
      .forEach((name) => show(name, "–"));
    showTimes();
    return;
  }
  const i = indexAt(track, t_s);
  const [e_m, n_m] = placeAt(track, t_s);
  showTimes();
  show("e", number(e_m, 1));
  show("n", number(n_m, 1));
  show("u", number(track.u_m[i], 1));
  show("sigma", length(track.sigma_m[i]));
  const speed_m_s = valueAt(line("speed", "main"), t_s);
  show("speed", speed_m_s === null ? "–" : `${number(speed_m_s, 1)} m/s`);
  show("heading", heading(track.heading_rad[i]));
  const moment = {
    point: (/** @type {string} */ column) => (close ? (track.more[column]?.[i] ?? NaN) : null),
    chart: (/** @type {string} */ chart, /** @type {string} */ series) => valueAt(line(chart, series), t_s, 0),
  };
  for (const { name, words } of system.readouts) show(name, words(moment));
  const last = visits
    .filter((visit) => visit.accepted && visitTime(visit) <= t_s)
    .reduce(
      (/** @type {typeof visits[0] | null} */ best, visit) =>
        !best || visitTime(visit) > visitTime(best) ? visit : best,
      null,
    );
  show("marker", last ? `${last.marker} · ${duration(t_s - visitTime(last))}` : "–");
  const near = app.grid.nearest(e_m, n_m, 1, NEAR_M)[0];
  show("near", near ? `${near.place.name} · ${length(near.distance_m)}` : "–");

  function showTimes() {
    const tenth = Math.floor(Math.abs(t_s) * 10 + 1e-6) % 10;
    show("time", `${t_s < 0 ? "−" : ""}${elapsed(Math.abs(t_s) + 1e-7)}.${tenth}`);
    show("clock", timeOfDay(walk.started_ms + t_s * 1000));
  }
}
