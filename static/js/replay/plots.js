// What a chart is, the charts that every system has, and parts of which a system makes its own. Drawn by `plot.js`.

export const DEGREES = 180 / Math.PI;

/**
 * @typedef {{chart: string, series: string, label: string, ink: string, dots?: boolean, dash?: number[], sigma?: string, translucent?: boolean}} PlotLine
 *   `sigma` names the chart with this line's sigma, drawn as a band; under a `translucent` line another one shows
 * @typedef {{chart: string, series: string, ink: string}} Strip full where the series is 1, thin where it is both 1 and 0 within a step
 * @typedef {{
 *   id: string, group: string, title: string, unit: string, factor: number, digits: number, lines: PlotLine[],
 *   strips?: Strip[], zero?: boolean, angle?: boolean, heights?: boolean, visits?: boolean, cap?: boolean,
 * }} Plot `title` and `label` are keys of words; `factor` brings the server's unit to `unit`; `cap` keeps single large values from
 *   flattening the rest; `strips` are drawn below
 */

/** The order in which they are drawn: the main one on top. @param {string} chart @returns {PlotLine[]} */
export const runs = (chart) => [
  { chart, series: "without_markers", label: "session.run.without_markers", ink: "runB", dash: [6, 4] },
  { chart, series: "filtered", label: "session.run.filtered", ink: "runA", dash: [2, 3] },
  { chart, series: "main", label: "session.run.main", ink: "runA" },
];

/** @param {string} chart @returns {PlotLine[]} */
export const mainRun = (chart) => [{ chart, series: "main", label: "session.run.main", ink: "runA" }];

/** @param {string} aid @returns {Plot} */
export const innovations = (aid) => ({
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

/** @param {string} id @param {string} unit @param {number} factor @returns {Plot} */
const sigma = (id, unit, factor) => ({
  id,
  group: "sigma",
  title: `plot.${id}`,
  unit,
  factor,
  digits: 2,
  zero: true,
  lines: runs(id),
});

/** @satisfies {Record<string, Plot>} */
export const COMMON = {
  speed: {
    id: "speed",
    group: "motion",
    title: "plot.speed",
    unit: "m/s",
    factor: 1,
    digits: 2,
    zero: true,
    lines: mainRun("speed"),
  },
  heading: {
    id: "heading",
    group: "heading",
    title: "plot.heading",
    unit: "°",
    factor: DEGREES,
    digits: 0,
    angle: true,
    lines: runs("heading"),
  },
  sigma_plan: sigma("sigma_plan", "m", 1),
  sigma_up: sigma("sigma_up", "m", 1),
  sigma_heading: sigma("sigma_heading", "°", DEGREES),
  markers: {
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
  height: {
    id: "height",
    group: "height",
    title: "plot.height",
    unit: "m",
    factor: 1,
    digits: 1,
    heights: true,
    lines: runs("height"),
  },
};

/**
 * The charts to ask the server for: those that are drawn, and those that the read-out needs whatever is drawn.
 * @param {Plot[]} plots
 * @param {import("../systems/index.js").Readout[]} readouts
 */
export function chartsOf(plots, readouts) {
  const drawn = plots.flatMap((plot) => [
    ...plot.lines.flatMap((line) => (line.sigma ? [line.chart, line.sigma] : [line.chart])),
    ...(plot.strips ?? []).map((strip) => strip.chart),
  ]);
  return [...new Set([...drawn, ...readouts.flatMap((readout) => readout.charts), "speed"])];
}
