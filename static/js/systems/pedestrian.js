// The pedestrian: a person with a sensor on each foot. The one file of the page that knows of feet.

import { percent } from "../format.js";
import { t } from "../i18n.js";

/** @typedef {import("../replay/plots.js").Plot} Plot */
/** @typedef {import("../replay/plots.js").PlotLine} PlotLine */

const FEET = [
  { name: "left", ink: "0" },
  { name: "right", ink: "1" },
];
const AIDS = ["zupt", "heading", "maru", "separation", "altimeter"];

/** @type {import("./index.js").System} */
export const system = {
  name: "pedestrian",
  carrierKind: "person",
  icon: `<circle class="disc" r="8"/>`,
  uploadSlots: FEET.map(({ name }) => ({
    stream: name,
    id: `foot-${name}`,
    kind: "imu",
    required: false,
    columns: [],
  })),
  exchangeable: true,
  slotOf: footOf,
  instrument: null,
  placesItself: false,
  sessionBody: (feet) => ({ feet }),
  logBody: (foot) => ({ foot }),
  streamOf: (row) => row.stream ?? row.foot ?? null,
  parts: FEET,
  pointColumns: FEET.map(({ name }) => `${name}_stance`),
  aids: [...AIDS, "markers"],
  ladder: [1, 2, 3, 4].map((n) => AIDS.slice(0, n)),
  plots,
  plotGroups: ["motion", "field", "heading", "sigma", "innovations", "biases", "feet", "height"],
  firstPlotGroups: ["motion", "heading", "sigma", "height"],
  readouts: [{ name: "stance", charts: ["stance"], words: stances }],
  reportFigures: ({ stance_share }) => [{ value: stance_share.map(share).join(" / "), label: "report.stance" }],
  clients: () => import("./pedestrian_clients.js"),
  words: {},
};

/** @param {number | null} part */
const share = (part) => (part === null ? "–" : percent(part));

/**
 * Which foot a file is of, by its name; null when the name does not say.
 * @param {string} fileName
 * @returns {"left" | "right" | null}
 */
export function footOf(fileName) {
  const name = fileName.toLowerCase();
  const words = name.split(/[^a-z\u4e00-\u9fff]+/u);
  const says = (/** @type {string[]} */ options) =>
    words.some((w) => options.includes(w)) ||
    options.some((o) => o.length > 2 && name.includes(o)) ||
    options.some((o) => o >= "\u4e00" && name.includes(o));
  const left = says(["left", "l", "lf", "左"]);
  const right = says(["right", "r", "rf", "右"]);
  if (left === right) return null;
  return left ? "left" : "right";
}

/**
 * Whether each foot stands at the cursor.
 * @param {import("./system.js").Moment} moment
 */
function stances({ point, chart }) {
  return FEET.map(({ name }) => {
    const stance = point(`${name}_stance`) ?? chart("stance", name);
    const words = stance === 1 ? t("pedestrian.readout.stands") : stance === 0 ? t("pedestrian.readout.swings") : "–";
    return `${t(`pedestrian.readout.${name}`)} ${words}`;
  }).join(" · ");
}

/**
 * @param {typeof import("../replay/plots.js")} kit
 * @returns {Plot[]}
 */
function plots({ COMMON, DEGREES, innovations, mainRun }) {
  const feet = (/** @type {string} */ chart, /** @type {Partial<PlotLine>} */ more = {}) =>
    FEET.map(({ name, ink }) => ({
      chart,
      series: name,
      label: `stream.${name}`,
      ink,
      translucent: name === "right",
      ...more,
    }));
  /** @param {string} id @param {string} unit @param {number} digits @param {Partial<Plot>} more @returns {Plot} */
  const motion = (id, unit, digits, more) => ({
    id,
    group: "motion",
    title: `plot.${id}`,
    unit,
    factor: 1,
    digits,
    lines: feet(id),
    ...more,
  });
  const strips = FEET.map(({ name, ink }) => ({ chart: "stance", series: name, ink }));
  /** @param {string} chart @param {string} unit @param {number} factor @param {number} digits @returns {Plot[]} */
  const biases = (chart, unit, factor, digits) =>
    FEET.map(({ name }) => ({
      id: `${chart}_${name}`,
      group: "biases",
      title: `plot.${chart}_${name}`,
      unit,
      factor,
      digits,
      lines: ["x", "y", "z"].map((axis, i) => ({
        chart,
        series: `${name}_${axis}`,
        label: `axis.${axis}`,
        ink: ["0", "1", "arrow"][i],
        sigma: `${chart}_sigma`,
      })),
    }));
  const { height } = COMMON;
  return [
    COMMON.speed,
    motion("gyro_norm", "rad/s", 2, { zero: true, strips }),
    motion("force_norm", "m/s²", 1, { strips }),
    motion("rate", "Hz", 0, { zero: true }),
    motion("field", "µT", 1, { group: "field" }),
    COMMON.heading,
    motion("magnetic", "°", 1, { group: "heading", factor: DEGREES, lines: feet("magnetic", { dots: true }) }),
    COMMON.sigma_plan,
    COMMON.sigma_up,
    COMMON.sigma_heading,
    ...AIDS.map(innovations),
    COMMON.markers,
    ...biases("gyro_bias", "°/h", DEGREES * 3600, 0),
    ...biases("accelerometer_bias", "m/s²", 1, 3),
    motion("separation", "m", 2, { group: "feet", zero: true, lines: mainRun("separation") }),
    { ...height, lines: [...feet("pressure_height"), ...height.lines] },
  ];
}
