// The surveyor's pole: how sure the tip is and north, its landings, and what fixes and landings say. Made of what the server
// declares, and fetched with its words when a session of it is opened.

import { t } from "../i18n.js";

/** @typedef {import("./index.js").System} System */

/** Where the tip is on the ground: the chart in which the server has that of any part. */
const LANDED = "stance";
const AIDS = ["fix", "tip"];

/**
 * @param {System} declared
 * @returns {System}
 */
export const refined = (declared) => ({
  ...declared,
  // A pole with the disc of its antenna.
  icon: `<path class="disc" d="M-1.5 8V-2H-6V-7H6V-2H1.5V8Z"/>`,
  plots,
  plotGroups: ["sigma", "heading", "innovations", "motion", "height"],
  firstPlotGroups: ["sigma", "innovations", "height"],
  readouts: [{ name: "tip", charts: [LANDED], words: onGround }],
});

/**
 * Whether the tip is on the ground at the cursor.
 * @param {import("./system.js").Moment} moment
 */
function onGround({ chart }) {
  const landed = chart(LANDED, "tip");
  const words = landed === 1 ? t("pole.readout.on_ground") : landed === 0 ? t("pole.readout.in_air") : "–";
  return `${t("pole.readout.tip")} ${words}`;
}

/**
 * @param {typeof import("../replay/plots.js")} kit
 * @returns {import("../replay/plots.js").Plot[]}
 */
function plots({ COMMON, innovations }) {
  const strips = [{ chart: LANDED, series: "tip", ink: "0" }];
  // A survey is worth centimetres.
  const { sigma_plan, sigma_up, sigma_heading, heading, markers, height, speed } = COMMON;
  return [
    { ...sigma_plan, digits: 3, strips },
    { ...sigma_up, digits: 3, strips },
    { ...sigma_heading, digits: 2 },
    heading,
    ...AIDS.map(innovations),
    markers,
    speed,
    { ...height, digits: 2 },
  ];
}
