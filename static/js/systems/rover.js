// The rover: its track in the colours of what each position rests on, the anchors on the map, satellites in the sky. Made of what
// the server declares, and fetched with its words when a session of it is opened.

import { charts as fetchCharts } from "../api.js";
import { length, number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { inkNamed } from "../map/ink.js";
import { valueAt } from "../replay/lines.js";

/** @typedef {import("./index.js").System} System */
/** @typedef {import("../replay/lines.js").Line} Line */

/** What a position rests on, by the number that the server gives it, with its ink. */
const QUALITIES = /** @type {const} */ ([
  ["fixed", "5"],
  ["float", "warn"],
  ["uwb", "runA"],
  ["single", "bad"],
  ["predicted", "muted"],
]);
const ANCHOR = ["anchor_east", "anchor_north", "anchor_bias", "anchor_bias_sigma", "anchor_used"];
const SKY = ["elevation", "azimuth"];
/** Cells of charts that are fetched for the map: five a second over a quarter of an hour. */
const CELLS = 4500;
/** Where satellites stand is told once in ten seconds. */
const SKY_S = 11;
/** Less than this share of its ranges used: an anchor in doubt. */
const GOOD_SHARE = 0.7;
/** A dash so short that nothing shows of the line. */
const NOTHING = [0, 1e9];

/**
 * @param {System} declared
 * @returns {System}
 */
export const refined = (declared) => ({
  ...declared,
  // An antenna on wheels.
  icon: `<path class="disc" d="M-7 -6H7V-2H2V2H7V7H-7V2H-2V-2H-7Z"/>`,
  // RINEX and ranges are no tables of the columns that are streamed.
  uploadSlots: declared.uploadSlots.map((slot) => ({ ...slot, columns: [] })),
  slotOf,
  plots,
  plotGroups: ["rover", "sigma", "motion", "height"],
  firstPlotGroups: ["rover", "sigma"],
  readouts: [
    { name: "quality", charts: ["quality"], words: qualityAt },
    { name: "satellites", charts: ["satellites", "anchors"], words: countsAt },
    { name: "ratio", charts: ["ratio"], words: ({ chart }) => shown(chart("ratio", "main"), 1) },
  ],
  overlay,
});

/** By the endings of RINEX, and by the names of ranges; then by what a receiver's files are mostly called. @param {string} fileName */
export function slotOf(fileName) {
  const name = fileName.toLowerCase().replace(/\.(gz|zst)$/, "");
  if (/\.(nav|rnx\.nav|\d\d[nglpcf])$|_[gcejrm]n\.rnx$/.test(name)) return "navigation_1";
  if (/uwb|range|测距/.test(name)) return "ranges";
  if (/base|基准/.test(name)) return "base";
  return /rover|流动|\.(obs|\d\do)$|_[gcejrm]o\.rnx$/.test(name) ? "rover" : null;
}

/** @param {number | null} value @param {number} digits */
const shown = (value, digits) => (value === null ? "–" : number(value, digits));

/** @param {import("./system.js").Moment} moment */
function qualityAt({ chart }) {
  const found = QUALITIES[Math.round(chart("quality", "main") ?? 0) - 1];
  return found ? t(`rover.quality.${found[0]}`) : "–";
}

/** @param {import("./system.js").Moment} moment */
const countsAt = ({ chart }) => `${shown(chart("satellites", "main"), 0)} + ${shown(chart("anchors", "main"), 0)}`;

/**
 * @param {typeof import("../replay/plots.js")} kit
 * @returns {import("../replay/plots.js").Plot[]}
 */
function plots({ COMMON, mainRun }) {
  const { sigma_plan, sigma_up, height, speed } = COMMON;
  /** @type {(id: string, unit: string, digits: number) => import("../replay/plots.js").Plot} */
  const own = (id, unit, digits) => ({
    id,
    group: "rover",
    title: `plot.${id}`,
    unit,
    factor: 1,
    digits,
    zero: true,
    lines: mainRun(id),
  });
  return [
    own("quality", "", 0),
    {
      ...own("satellites", "", 0),
      lines: [
        { chart: "satellites", series: "main", label: "plot.satellites", ink: "runA" },
        { chart: "anchors", series: "main", label: "plot.anchors", ink: "runB" },
      ],
    },
    { ...own("ratio", "", 1), cap: true },
    own("base_age", "s", 1),
    // A rover is worth centimetres.
    { ...sigma_plan, digits: 3 },
    { ...sigma_up, digits: 3 },
    speed,
    { ...height, digits: 2 },
  ];
}

/**
 * What the map and the side show beside the track.
 * @param {string} id of the session
 * @param {import("../sessions/track.js").Track} track
 * @returns {Promise<import("./system.js").Overlay>}
 */
async function overlay(id, track) {
  const { series } = await fetchCharts(id, null, CELLS, ["quality", ...ANCHOR, ...SKY]);
  const line = (/** @type {string} */ chart, /** @type {string} */ name) =>
    series.find((one) => one.chart === chart && one.series === name);
  const anchors = series
    .filter(({ chart }) => chart === "anchor_east")
    .map(({ series: name }) => {
      const [e_m, n_m, bias_m, sigma_m, share] = ANCHOR.map((chart) => lastOf(line(chart, name)));
      return { name, place: /** @type {[number, number]} */ ([e_m, n_m]), bias_m, sigma_m, share };
    });
  const lines = byQuality(track, line("quality", "main"));
  const inks = new Set(lines.map(({ ink }) => ink));
  return {
    lines,
    places: anchors.map(({ name, place, bias_m, share }) => ({
      place,
      ink: share < GOOD_SHARE ? "bad" : "accent",
      label: `${name} · ${bias_m < 0 ? "−" : "+"}${number(Math.abs(bias_m), 2)} m`,
    })),
    legend: QUALITIES.filter(([, ink]) => inks.has(ink)).map(([word, ink]) => ({
      ink,
      words: t(`rover.quality.${word}`),
    })),
    card: (t_s) => html`${sky(series, t_s)}${anchorTable(anchors)}`,
  };
}

/** @param {Line | undefined} line */
const lastOf = (line) => line?.low.findLast((value) => value !== null) ?? NaN;

/**
 * The track in pieces, each of one quality. The last line shows nothing, as its ends alone are marked.
 * @param {import("../sessions/track.js").Track} track
 * @param {Line | undefined} quality
 * @returns {import("../map/runs.js").RunLine[]}
 */
export function byQuality(track, quality) {
  if (!quality) return [];
  /** @type {import("../map/runs.js").RunLine[]} */
  const pieces = [];
  let before = "";
  let now = "";
  track.t_s.forEach((t_s, i) => {
    const number = valueAt(quality, t_s, 0);
    now = QUALITIES[Math.round(number ?? 0) - 1]?.[1] ?? now;
    if (now === "") return;
    /** @type {import("../geometry.js").EastNorth} */
    const place = [track.e_m[i], track.n_m[i]];
    if (now !== before) {
      const end = pieces.at(-1)?.points.at(-1);
      pieces.push({ points: end ? [end] : [], ink: now, dash: [], width: 4 });
      before = now;
    }
    pieces.at(-1)?.points.push(place);
  });
  if (pieces.length === 0) return [];
  const all = Array.from(track.e_m, (e, i) => /** @type {[number, number]} */ ([e, track.n_m[i]]));
  return [...pieces, { points: all, ink: "runA", dash: NOTHING, width: 1 }];
}

/**
 * Where satellites stand at the cursor: north up, the horizon outside.
 * @param {Line[]} series
 * @param {number} t_s
 */
function sky(series, t_s) {
  const satellites = series.flatMap((one) => {
    if (one.chart !== "elevation") return [];
    const azimuth = series.find((other) => other.chart === "azimuth" && other.series === one.series);
    const [up, round] = [one, azimuth].map((line) => valueAt(line, t_s, SKY_S));
    if (up === null || round === null) return [];
    const [r, angle] = [((90 - up) / 90) * 100, (round * Math.PI) / 180];
    return [{ name: one.series, x: r * Math.sin(angle), y: -r * Math.cos(angle) }];
  });
  if (satellites.length === 0) return html``;
  const at = (/** @type {number} */ v) => v.toFixed(1);
  return html`<h3>${t("rover.sky")}</h3>
    <svg
      viewBox="-116 -116 232 224"
      role="img"
      aria-label="${t("rover.sky")}"
      data-testid="sky"
      font-size="10"
      fill="currentColor"
    >
      <g fill="none" stroke="currentColor" stroke-opacity="0.3">
        <circle r="100" />
        <circle r="66.7" />
        <circle r="33.3" />
        <path d="M-100 0H100M0-100V100" />
      </g>
      <text y="-104" text-anchor="middle">${t("rover.north")}</text>
      ${satellites.map(
        ({ name, x, y }) =>
          html`<g transform="translate(${at(x)} ${at(y)})"
            ><circle r="4" fill="${inkNamed(SYSTEM_INKS[name[0]] ?? "muted")}" /><text x="6" y="4">${name}</text></g
          >`,
      )}
    </svg>`;
}

/** @type {Record<string, string>} */
const SYSTEM_INKS = { G: "0", C: "1", E: "3", J: "5" };

/** @param {{name: string, bias_m: number, sigma_m: number, share: number}[]} anchors */
function anchorTable(anchors) {
  if (anchors.length === 0) return html``;
  return html`<h3>${t("rover.anchors")}</h3>
    <table data-testid="anchors">
      <thead>
        <tr>
          <th>${t("rover.anchor")}</th>
          <th>${t("rover.bias")}</th>
          <th>${t("rover.used")}</th>
        </tr>
      </thead>
      <tbody>
        ${anchors.map(
          ({ name, bias_m, sigma_m, share }) =>
            html`<tr>
              <td>${name}</td>
              <td class="mono">${number(bias_m, 2)} ± ${length(sigma_m)}</td>
              <td class="mono">${number(100 * share, 0)} %</td>
            </tr>`,
        )}
      </tbody>
    </table>`;
}
