// The moment of a replay on the cabin's board: the minutes before it, and the pose then, from a finished run's track and charts.

import { indexAt } from "../sessions/track.js";

/** @typedef {import("./cabin_drawing.js").Past} Past */

export const BODIES = ["cabin", "platform"];
export const BUDGETS_M = [0.015, 0.003];
const AXES = ["e", "n", "u"];
const ANGLES = ["yaw", "pitch", "roll"];

/** The charts of which it is made. */
export const CHARTS = [
  "off_plan",
  "off_plan_angles",
  "sigma_body",
  "sigma_angles",
  "protection_level",
  "aids",
  "state",
  "source",
  "time_left",
  "platform_angles",
];

/**
 * @param {any} found the charts of the minutes before
 * @param {import("../sessions/track.js").Track} track
 * @param {number} at_s
 */
export function momentOf(found, track, at_s) {
  /** @param {string} chart @param {string} series @param {number} t_s @returns {number | null} */
  const value = (chart, series, t_s) => {
    const line = found.series.find((/** @type {any} */ one) => one.chart === chart && one.series === series);
    return line ? (line.low[Math.floor((t_s - line.start_s) / line.step_s + 1e-6)] ?? null) : null;
  };
  /** @param {string} chart @param {string[]} series @param {number} t_s */
  const three = (chart, series, t_s) => {
    const all = series.map((name) => value(chart, name, t_s));
    return all.every((one) => one !== null) ? /** @type {number[]} */ (all) : null;
  };
  const lines = found.series.filter((/** @type {any} */ line) => line.chart === "aids");
  /** @type {string[]} */
  const names = lines.map((/** @type {any} */ line) => line.series).toSorted(byKind);
  const some = found.series.find((/** @type {any} */ line) => line.chart === "sigma_body");
  /** @type {number[]} */
  const times = some
    ? some.low.map((/** @type {unknown} */ _, /** @type {number} */ i) => some.start_s + (i + 0.5) * some.step_s)
    : [];
  /** @type {Past[]} */
  const past = times
    .filter((t_s) => value("state", "cabin", t_s) !== null)
    .map((t_s) => ({
      t_s,
      state: value("state", "cabin", t_s),
      source: value("source", "platform", t_s),
      aids: names.map((name) => (value("aids", name, t_s) ?? 0) > 0.5),
      off_m: BODIES.map((body) =>
        three(
          "off_plan",
          AXES.map((axis) => `${body}_${axis}`),
          t_s,
        ),
      ),
      sigma_m: BODIES.map((body) => value("sigma_body", body, t_s)),
      off_rad: BODIES.map((body) =>
        three(
          "off_plan_angles",
          ANGLES.map((angle) => `${body}_${angle}`),
          t_s,
        ),
      ),
      sigma_rad: BODIES.map((body) => value("sigma_angles", body, t_s)),
    }));
  const last = past.at(-1);
  const last_s = last?.t_s ?? at_s;
  const i = indexAt(track, at_s);
  const { more } = track;
  const places = [
    [track.e_m[i], track.n_m[i], track.u_m[i]],
    [more.platform_e_m[i], more.platform_n_m[i], more.platform_u_m[i]],
  ];
  const angles = [
    [track.heading_rad[i], more.pitch_rad[i], more.roll_rad[i]],
    three("platform_angles", ANGLES, last_s) ?? [NaN, NaN, NaN],
  ];
  const nowhere = [NaN, NaN, NaN];
  const bodies = BODIES.map((body, k) => {
    if (!Number.isFinite(places[k][0])) return null;
    const sigma_m = value("sigma_body", body, last_s) ?? NaN;
    return {
      place_m: places[k],
      angles_rad: angles[k],
      sigma_m: [sigma_m],
      sigma_rad: [value("sigma_angles", body, last_s) ?? NaN],
      off_m: last?.off_m[k] ?? nowhere,
      off_rad: last?.off_rad[k] ?? nowhere,
      level_m: value("protection_level", body, last_s) ?? NaN,
      left_s: value("time_left", body, last_s) ?? NaN,
      valid: true,
      measured: k === 0 || last?.source !== 3,
      alarm: 3 * sigma_m > BUDGETS_M[k],
      near: 3 * sigma_m > 0.8 * BUDGETS_M[k],
    };
  });
  const frame = { t_s: at_s, age_s: 0, state: Math.round(last?.state ?? 0), aids: 0n, bodies, states: [] };
  return { names, past, frame };
}

const LAST = ["encoders", "platform_imu"];

/** The inertial sensor first, then antennas, stations, encoders, the platform's sensor. @param {string} a @param {string} b */
function byKind(a, b) {
  const rank = (/** @type {string} */ name) => (name === "imu" ? 0 : 2 + LAST.indexOf(name));
  return rank(a) - rank(b) || a.localeCompare(b, "en", { numeric: true });
}
