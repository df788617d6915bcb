// Where and how a walk began, as typed. What is wrong is said in words, before anything is sent.

import { t } from "../i18n.js";

/**
 * @param {FormData} data
 * @param {(name: string) => string | undefined} markerNamed the marker's own spelling
 * @returns {{start?: {marker: string} | {position_m: [number, number, number]}, initial_heading_deg?: number}}
 */
export function readStart(data, markerNamed) {
  const text = (/** @type {string} */ name) => String(data.get(name) ?? "").trim();
  const heading = text("heading");
  const initial = heading === "" ? {} : { initial_heading_deg: figure(heading, "upload.heading") };
  switch (text("start")) {
    case "marker": {
      const typed = text("marker");
      if (typed === "") throw new Error(t("upload.need_marker"));
      // A marker that is not in the plan may still be in the marker table: the server knows.
      return { start: { marker: markerNamed(typed) ?? typed }, ...initial };
    }
    case "position":
      return {
        start: {
          position_m: [
            figure(text("east"), "axis.east_m"),
            figure(text("north"), "axis.north_m"),
            figure(text("up"), "axis.up_m"),
          ],
        },
        ...initial,
      };
    default:
      return initial;
  }
}

/**
 * @param {string} typed
 * @param {string} key names the field
 */
function figure(typed, key) {
  const value = Number(typed.replace(",", ".").replace("−", "-"));
  if (typed === "" || !Number.isFinite(value))
    throw new Error(t("upload.need_number", { field: t(key), found: typed }));
  return value;
}
