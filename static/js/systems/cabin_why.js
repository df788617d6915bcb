// Why a device of the cabin is shut out, by what was found wrong with it; and what stands in the instrument's file of the devices.

import { has, t } from "../i18n.js";

/**
 * What was wrong with a device at a time, by the words of its kinds; its name alone where nothing was.
 * @param {any[]} anomalies
 * @param {Map<string, string[]>} groups by the device's name: those of which it is one
 * @param {{name: string, t_s: number}} cell
 */
export function whyOut(anomalies, groups, { name, t_s }) {
  const sources = [name, ...(groups.get(name) ?? [])];
  const words = anomalies
    .filter(({ figures, detail }) => {
      const device = figures?.device ?? String(detail).split(":")[0];
      return sources.includes(device) || (name === "encoders" && /^leg_\d$/.test(device));
    })
    .filter(({ t_start_ns, t_end_ns }) => t_start_ns / 1e9 <= t_s + 0.5 && t_s - 0.5 <= t_end_ns / 1e9)
    .map(({ anomaly }) => wordOf(anomaly));
  return [name, ...new Set(words)].join(" · ");
}

/** @param {string} kind of anomaly */
export const wordOf = (kind) => (has(`cabin.anomaly.${kind}`) ? t(`cabin.anomaly.${kind}`) : kind);

/**
 * A section of the instrument's file.
 * @param {string | null} instrument
 * @param {string} name
 */
function sectionOf(instrument, name) {
  return (instrument ?? "").split(new RegExp(`^\\[${name}\\]`, "m"))[1]?.split(/^\[\w/m)[0] ?? "";
}

/** @param {string} section @param {string} key @returns {string[]} */
function listOf(section, key) {
  const list = new RegExp(`^${key}\\s*=\\s*\\[([^\\]]*)\\]`, "m").exec(section)?.[1] ?? "";
  return [...list.matchAll(/"([^"]*)"/g)].map((found) => found[1]);
}

/**
 * Of which groups each antenna and each station is one.
 * @param {string | null} instrument
 * @returns {Map<string, string[]>}
 */
export function groupsOf(instrument) {
  const antennas = sectionOf(instrument, "antennas");
  const makes = listOf(antennas, "make");
  const ofAntennas = listOf(antennas, "names").map((name, k) => [name, [makes[k], "antennas"]]);
  const ofStations = listOf(sectionOf(instrument, "stations"), "names").map((name) => [name, ["stations"]]);
  return new Map(/** @type {[string, string[]][]} */ ([...ofAntennas, ...ofStations]));
}

/**
 * Names and places of the stations.
 * @param {string | null} instrument
 */
export function stationsOf(instrument) {
  const section = sectionOf(instrument, "stations");
  const names = listOf(section, "names");
  const list = section.match(/position_n\s*=\s*\[([\s\S]*?)\]\s*(?:#.*)?\n\s*[\]\w]/)?.[0] ?? "";
  const places = [...list.matchAll(/\[\s*([-+.\deE]+)\s*,\s*([-+.\deE]+)\s*,/g)];
  return places.slice(0, names.length).map(([, e, n], k) => ({ name: names[k], e_m: Number(e), n_m: Number(n) }));
}
