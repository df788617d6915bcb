// The feed cabin: where it is beside where it should be, how sure that is, and what it rests on. Made of what the server declares,
// and fetched with its words when a session of it is opened.

import { t } from "../i18n.js";

/** @typedef {import("./index.js").System} System */
/** @typedef {import("../replay/plots.js").Plot} Plot */

const AXES = ["e", "n", "u"];
const AIDS = ["antennas", "stations"];
const BODIES = ["cabin", "platform"];
/** By the number in the chart `state`. */
export const STATES = ["aligning", "full", "reduced", "coasting", "silent"];

/**
 * @param {System} declared
 * @returns {System}
 */
export const refined = (declared) => ({
  ...declared,
  // A ring with the platform under it.
  icon: `<circle class="disc" r="8"/><circle class="disc" r="3"/>`,
  pointColumns: ["roll_rad", "pitch_rad", "platform_e_m", "platform_n_m", "platform_u_m"],
  plots,
  plotGroups: ["plan", "level", "sigma", "heading", "innovations", "motion", "height"],
  firstPlotGroups: ["plan", "level", "innovations"],
  readouts: [
    { name: "state", charts: ["state"], words: ({ chart }) => stateOf(chart) },
    { name: "left", charts: ["time_left"], words: ({ chart }) => left(chart) },
  ],
  board: () => import("./cabin_board.js"),
});

/** @param {import("./system.js").Moment["chart"]} chart */
function stateOf(chart) {
  const state = chart("state", "cabin");
  return state === null ? "–" : t(`cabin.state.${STATES[Math.round(state)] ?? STATES[0]}`);
}

/** @param {import("./system.js").Moment["chart"]} chart */
function left(chart) {
  const left_s = chart("time_left", "cabin");
  return left_s === null ? "–" : `${left_s.toFixed(0)} s`;
}

/**
 * @param {typeof import("../replay/plots.js")} kit
 * @returns {Plot[]}
 */
function plots({ COMMON, DEGREES, innovations }) {
  const { sigma_plan, sigma_up, sigma_heading, heading, height, speed } = COMMON;
  const mm = { unit: "mm", factor: 1000, digits: 1 };
  const off = (/** @type {string} */ body, /** @type {string} */ title) => ({
    id: body === "cabin" ? "off_plan" : "off_plan_platform",
    group: "plan",
    title,
    ...mm,
    lines: AXES.map((axis, i) => ({
      chart: "off_plan",
      series: `${body}_${axis}`,
      label: `axis.${axis}`,
      ink: ["0", "1", "3"][i],
    })),
  });
  const offAngles = (/** @type {string} */ body) => ({
    id: `off_plan_angles_${body}`,
    group: "plan",
    title: `plot.off_plan_angles_${body}`,
    unit: "°",
    factor: DEGREES,
    digits: 3,
    lines: ["yaw", "pitch", "roll"].map((angle, i) => ({
      chart: "off_plan_angles",
      series: `${body}_${angle}`,
      label: `board.${angle}`,
      ink: ["0", "1", "3"][i],
    })),
  });
  const level = (/** @type {string} */ body, /** @type {string} */ title) => ({
    id: body === "cabin" ? "protection_level" : "protection_level_platform",
    group: "level",
    title,
    ...mm,
    zero: true,
    lines: [{ chart: "protection_level", series: body, label: `stream.${body}`, ink: "runA" }],
  });
  return [
    off("cabin", "plot.off_plan"),
    off("platform", "plot.off_plan_platform"),
    offAngles("cabin"),
    offAngles("platform"),
    level("cabin", "plot.protection_level"),
    level("platform", "plot.protection_level_platform"),
    {
      id: "sigma_body",
      group: "sigma",
      title: "plot.sigma_body",
      ...mm,
      zero: true,
      lines: BODIES.map((body, i) => ({
        chart: "sigma_body",
        series: body,
        label: `stream.${body}`,
        ink: ["0", "1"][i],
      })),
    },
    { ...sigma_plan, ...mm },
    { ...sigma_up, ...mm },
    { ...sigma_heading, digits: 4 },
    heading,
    ...AIDS.map(innovations),
    speed,
    { ...height, digits: 2 },
  ];
}
