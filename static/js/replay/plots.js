// Which charts there are: their lines, units and colours. Drawn by `plot.js`, in this order.

import { t } from "../i18n.js";

const DEGREES = 180 / Math.PI;

/**
 * @typedef {{chart: string, series: string, label: string, ink: string, dots?: boolean, dash?: number[], sigma?: string, plus?: string}} PlotLine
 *   `sigma` names the chart with this line's sigma, drawn as a band; `plus` a chart whose value is added
 * @typedef {{
 *   id: string, group: string, title: string, unit: string, factor: number, digits: number, lines: PlotLine[],
 *   zero?: boolean, angle?: boolean, stance?: boolean, heights?: boolean, visits?: boolean, cap?: boolean,
 * }} Plot `factor` brings the server's unit to `unit`; `cap` keeps single large values from flattening the rest
 */

/** What may be switched on and off together. */
export const GROUPS = ["motion", "field", "heading", "sigma", "innovations", "biases", "feet", "height"];

const feet = (/** @type {string} */ chart, /** @type {Partial<PlotLine>} */ more = {}) =>
  ["left", "right"].map((foot) => ({ chart, series: foot, label: `foot.${foot}`, ink: foot, ...more }));
/** The order in which they are drawn: the main one on top. */
const runs = (/** @type {string} */ chart) => [
  { chart, series: "without_markers", label: "session.run.without_markers", ink: "runB", dash: [6, 4] },
  { chart, series: "filtered", label: "session.run.filtered", ink: "runA", dash: [2, 3] },
  { chart, series: "main", label: "session.run.main", ink: "runA" },
];
const innovations = (/** @type {string} */ aid) => ({
  id: `nis_${aid}`,
  group: "innovations",
  title: `plot.nis_${aid}`,
  unit: "",
  factor: 1,
  digits: 2,
  zero: true,
  cap: true,
  lines: [
    { chart: `nis_${aid}`, series: "accepted", label: "plot.accepted", ink: "runA", dots: true },
    { chart: `nis_${aid}`, series: "rejected", label: "plot.rejected", ink: "bad", dots: true },
  ],
});
const biases = (
  /** @type {string} */ chart,
  /** @type {string} */ foot,
  /** @type {string} */ unit,
  /** @type {number} */ factor,
  /** @type {number} */ digits,
) => ({
  id: `${chart}_${foot}`,
  group: "biases",
  title: `plot.${chart}_${foot}`,
  unit,
  factor,
  digits,
  lines: ["x", "y", "z"].map((axis, i) => ({
    chart,
    series: `${foot}_${axis}`,
    label: `axis.${axis}`,
    ink: ["left", "right", "arrow"][i],
    sigma: `${chart}_sigma`,
  })),
});

/** @type {Plot[]} */
export const PLOTS = [
  {
    id: "speed",
    group: "motion",
    title: "plot.speed",
    unit: "m/s",
    factor: 1,
    digits: 2,
    zero: true,
    lines: [{ chart: "speed", series: "main", label: "session.run.main", ink: "runA" }],
  },
  {
    id: "gyro_norm",
    group: "motion",
    title: "plot.gyro_norm",
    unit: "rad/s",
    factor: 1,
    digits: 2,
    zero: true,
    stance: true,
    lines: feet("gyro_norm"),
  },
  {
    id: "force_norm",
    group: "motion",
    title: "plot.force_norm",
    unit: "m/s²",
    factor: 1,
    digits: 1,
    stance: true,
    lines: feet("force_norm"),
  },
  {
    id: "rate",
    group: "motion",
    title: "plot.rate",
    unit: "Hz",
    factor: 1,
    digits: 0,
    zero: true,
    lines: feet("rate"),
  },
  { id: "field", group: "field", title: "plot.field", unit: "µT", factor: 1, digits: 1, lines: feet("field") },
  {
    id: "heading",
    group: "heading",
    title: "plot.heading",
    unit: "°",
    factor: DEGREES,
    digits: 0,
    angle: true,
    lines: runs("heading"),
  },
  {
    id: "magnetic",
    group: "heading",
    title: "plot.magnetic",
    unit: "°",
    factor: DEGREES,
    digits: 1,
    lines: feet("magnetic", { dots: true }),
  },
  {
    id: "sigma_plan",
    group: "sigma",
    title: "plot.sigma_plan",
    unit: "m",
    factor: 1,
    digits: 2,
    zero: true,
    lines: runs("sigma_plan"),
  },
  {
    id: "sigma_up",
    group: "sigma",
    title: "plot.sigma_up",
    unit: "m",
    factor: 1,
    digits: 2,
    zero: true,
    lines: runs("sigma_up"),
  },
  {
    id: "sigma_heading",
    group: "sigma",
    title: "plot.sigma_heading",
    unit: "°",
    factor: DEGREES,
    digits: 2,
    zero: true,
    lines: runs("sigma_heading"),
  },
  ...["zupt", "heading", "maru", "separation", "altimeter"].map(innovations),
  {
    id: "nis_markers",
    group: "innovations",
    title: "plot.nis_markers",
    unit: "",
    factor: 1,
    digits: 1,
    zero: true,
    visits: true,
    lines: [],
  },
  biases("gyro_bias", "left", "°/h", DEGREES * 3600, 0),
  biases("gyro_bias", "right", "°/h", DEGREES * 3600, 0),
  biases("accelerometer_bias", "left", "m/s²", 1, 3),
  biases("accelerometer_bias", "right", "m/s²", 1, 3),
  {
    id: "separation",
    group: "feet",
    title: "plot.separation",
    unit: "m",
    factor: 1,
    digits: 2,
    zero: true,
    lines: [{ chart: "separation", series: "main", label: "session.run.main", ink: "runA" }],
  },
  {
    id: "height",
    group: "height",
    title: "plot.height",
    unit: "m",
    factor: 1,
    digits: 1,
    heights: true,
    lines: [...feet("pressure_height"), ...runs("height")],
  },
];

/** What a person sees at first. */
export const FIRST_GROUPS = ["motion", "heading", "sigma", "height"];

/**
 * The charts to ask the server for.
 * @param {Iterable<string>} groups
 */
export function chartsOf(groups) {
  const wanted = new Set(groups);
  const names = PLOTS.filter((plot) => wanted.has(plot.group)).flatMap((plot) =>
    plot.lines.flatMap((line) => (line.sigma ? [line.chart, line.sigma] : [line.chart])),
  );
  // Whether a foot stands is in the read-out whatever is drawn.
  return [...new Set([...names, "stance", "speed"])];
}

/** @param {string} group */
export const groupName = (group) => t(`plots.${group}`);
