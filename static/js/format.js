// Numbers and times as people read them. Site time is UTC+8 and says so; distances are metres.

import { currentLanguage, t } from "./i18n.js";
import { headingDegrees } from "./geometry.js";

const ZONE = "Asia/Shanghai";
const NONE = "–";

/**
 * @param {number | null | undefined} value
 * @param {number} digits
 */
export function number(value, digits = 1) {
  return value === null || value === undefined || !Number.isFinite(value)
    ? NONE
    : value
        .toFixed(digits)
        .replace(/^-(0(\.0*)?)$/, "$1")
        .replace("-", "−");
}

/**
 * A length: decimetres while they mean something, then metres, then kilometres.
 * @param {number | null | undefined} m
 */
export function length(m) {
  if (m === null || m === undefined || !Number.isFinite(m)) return NONE;
  if (Math.abs(m) < 99.95) return `${number(m, 1)} m`;
  if (Math.abs(m) < 9999.5) return `${number(m, 0)} m`;
  return `${number(m / 1000, 1)} km`;
}

/**
 * How long: "12 s", "3 min 05 s", "1 h 20 min".
 * @param {number | null | undefined} seconds
 */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NONE;
  const s = Math.max(0, Math.floor(seconds));
  if (s < 60) return t("unit.s", { s });
  if (s < 3600) return t("unit.min_s", { min: Math.floor(s / 60), s: String(s % 60).padStart(2, "0") });
  return t("unit.h_min", { h: Math.floor(s / 3600), min: String(Math.floor((s % 3600) / 60)).padStart(2, "0") });
}

/**
 * How long, in one unit, for narrow places.
 * @param {number | null | undefined} seconds
 */
export function shortDuration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NONE;
  if (seconds < 60) return t("unit.s", { s: Math.max(0, Math.floor(seconds)) });
  if (seconds < 3600) return t("unit.min", { min: Math.floor(seconds / 60) });
  return t("unit.h_min", {
    h: Math.floor(seconds / 3600),
    min: String(Math.floor((seconds % 3600) / 60)).padStart(2, "0"),
  });
}

/**
 * Time into a walk: "4:05" or "1:04:05".
 * @param {number | null | undefined} seconds
 */
export function elapsed(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NONE;
  const s = Math.max(0, Math.floor(seconds));
  const ms = `${String(Math.floor((s % 3600) / 60)).padStart(s >= 3600 ? 2 : 1, "0")}:${String(s % 60).padStart(2, "0")}`;
  return s >= 3600 ? `${Math.floor(s / 3600)}:${ms}` : ms;
}

/**
 * Degrees from true north, three figures as on a compass.
 * @param {number | null | undefined} heading_rad
 */
export function heading(heading_rad) {
  if (heading_rad === null || heading_rad === undefined) return NONE;
  return `${String(Math.round(headingDegrees(heading_rad)) % 360).padStart(3, "0")}°`;
}

/** The site's zone knows no summer time. */
const ZONE_OFFSET_MS = 8 * 3_600_000;

/**
 * Site time of day. By hand: it is shown with every frame, and a formatter of the system's takes tens of milliseconds to make.
 * @param {number | string | Date} when
 */
export function clock(when) {
  return new Date(new Date(when).getTime() + ZONE_OFFSET_MS).toISOString().slice(11, 19);
}

/** The site's day, as a field for dates has it. @param {number} when_ms */
export const siteDay = (when_ms) => new Date(when_ms + ZONE_OFFSET_MS).toISOString().slice(0, 10);

/** When a day of the site begins. @param {string} day as such a field has it */
export const dayBegins = (day) => Date.parse(`${day}T00:00:00Z`) - ZONE_OFFSET_MS;

/**
 * Site date and time.
 * @param {number | string | Date | null | undefined} when
 */
export function dateTime(when) {
  if (!when) return NONE;
  return new Intl.DateTimeFormat(currentLanguage() === "en" ? "en-GB" : "zh-CN", {
    timeZone: ZONE,
    year: "numeric",
    month: "short",
    day: "2-digit",
    hour: "2-digit",
    minute: "2-digit",
    hourCycle: "h23",
  }).format(new Date(when));
}

/**
 * A size in bytes, decimal units as disks and browsers count them.
 * @param {number} bytes
 */
export function bytes(bytes) {
  if (bytes < 1000) return `${bytes} B`;
  if (bytes < 1e6) return `${(bytes / 1e3).toFixed(0)} kB`;
  if (bytes < 1e9) return `${(bytes / 1e6).toFixed(1)} MB`;
  return `${(bytes / 1e9).toFixed(2)} GB`;
}

/** @param {number} fraction */
export function percent(fraction) {
  return `${Math.round(fraction * 100)} %`;
}
