// The surveyor's pole: its way in the colours of the fixes that it rests on, where it landed, its points with their sigmas; and
// what a survey may come to. Made of what the server declares, and fetched with its words when a session of it is opened.

import { charts as fetchCharts, surveyedPoints } from "../api.js";
import { number } from "../format.js";
import { K95 } from "../geometry.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { forecastTable } from "./pole_forecast.js";

/** @typedef {import("./index.js").System} System */
/** @typedef {import("../replay/lines.js").Line} Line */
/** @typedef {import("../geometry.js").EastNorth} EastNorth */
/**
 * @typedef {{
 *   marker: string, place: {e_m: number, n_m: number, u_m: number | null}, latitude_deg: number, longitude_deg: number, height_m: number,
 *   sigma_m: [number, number, number], visits: number, visits_apart_m: number, off_m: [number, number, number] | null,
 * }} SurveyedPoint
 */

/** Where the tip is on the ground: the chart in which the server has that of any part. */
const LANDED = "stance";
const AIDS = ["fix", "tip"];
/** What the way rests on, by the number that the server gives it, with its ink; the first where there is no fix. */
const QUALITIES = /** @type {const} */ ([
  ["none", "muted"],
  ["fixed", "arrow"],
  ["float", "warn"],
  ["single", "bad"],
]);
/** A fix counts for the way until so long after it, s. */
const FIX_S = 1;
/** Cells of charts that are fetched for the map: five a second over a quarter of an hour. */
const CELLS = 4500;
/** Ellipses of centimetres are drawn so many times as large. */
const LARGER = 10;
/** Between two ellipses of the way, s. */
const ELLIPSE_S = 10;
const CORNERS = 32;
/** A dash so short that nothing shows of the line. */
const NOTHING = [0, 1e9];

/**
 * @param {System} declared
 * @returns {System}
 */
export const refined = (declared) => ({
  ...declared,
  // A pole with the disc of its antenna.
  icon: `<path class="disc" d="M-1.5 8V-2H-6V-7H6V-2H1.5V8Z"/>`,
  pointColumns: ["sigma_e_m", "sigma_n_m"],
  plots,
  plotGroups: ["sigma", "heading", "innovations", "motion", "height"],
  firstPlotGroups: ["sigma", "innovations", "height"],
  readouts: [{ name: "tip", charts: [LANDED], words: onGround }],
  overlay,
  plan: forecastTable,
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
  const plots = [
    { ...sigma_plan, digits: 3, strips },
    { ...sigma_up, digits: 3, strips },
    { ...sigma_heading, digits: 2 },
    heading,
    ...AIDS.map(innovations),
    markers,
    speed,
    { ...height, digits: 2 },
  ];
  // It is the same without its visits.
  const own = (/** @type {import("../replay/plots.js").PlotLine[]} */ lines) =>
    lines.filter(({ series }) => series !== "without_markers");
  return plots.map((plot) => ({ ...plot, lines: own(plot.lines) }));
}

/**
 * What the map and the side show beside the track.
 * @param {string} id of the session
 * @param {import("../sessions/track.js").Track} track
 * @returns {Promise<import("./system.js").Overlay>}
 */
async function overlay(id, track) {
  const surveyed = surveyedPoints(id).catch(() => []);
  const { series } = await fetchCharts(id, null, CELLS, ["quality", LANDED]);
  /** @type {SurveyedPoint[]} */
  const points = await surveyed;
  const line = (/** @type {string} */ chart) => series.find((/** @type {Line} */ one) => one.chart === chart);
  const pieces = byFixes(track, line("quality"));
  const inks = new Set(pieces.map(({ ink }) => ink));
  const landings = landed(track, line(LANDED));
  return {
    lines: [
      ...pieces,
      ...alongTheWay(track),
      ...points.map(({ place, sigma_m: [e, n] }) => ring([place.e_m, place.n_m], e, n, "accent")),
      // The ends of the last line alone are marked: those of the way.
      { points: Array.from(track.e_m, (e, i) => [e, track.n_m[i]]), ink: "runA", dash: NOTHING, width: 1 },
    ],
    places: [
      ...landings.map((place) => ({ place, ink: "0", label: "", radius_px: 3.5 })),
      ...points.map(({ marker, place, sigma_m: [e, n] }) => ({
        place: /** @type {EastNorth} */ ([place.e_m, place.n_m]),
        ink: "accent",
        label: `${marker} ± ${number(Math.hypot(e, n), 3)} m`,
      })),
    ],
    legend: [
      ...QUALITIES.filter(([, ink]) => inks.has(ink)).map(([word, ink]) => ({ ink, words: t(`pole.fixes.${word}`) })),
      ...(landings.length > 0 ? [{ ink: "0", words: t("pole.landings", { n: landings.length }) }] : []),
      { ink: "runB", words: t("pole.ellipses", { n: LARGER }) },
    ],
    card: () => html`${pointTable(id, points)}${forecastTable()}`,
  };
}

/**
 * The way in pieces, each resting on fixes of one quality, or on none.
 * @param {import("../sessions/track.js").Track} track
 * @param {Line | undefined} quality
 * @returns {import("../map/runs.js").RunLine[]}
 */
export function byFixes(track, quality) {
  if (!quality) return [];
  /** @type {import("../map/runs.js").RunLine[]} */
  const pieces = [];
  let newest = 0;
  let seen_s = -Infinity;
  track.t_s.forEach((t_s, i) => {
    const cell = quality.low[Math.floor((t_s - quality.start_s) / quality.step_s)];
    if (cell !== null && cell !== undefined) [newest, seen_s] = [Math.round(cell), t_s];
    const [, ink] = QUALITIES[t_s - seen_s <= FIX_S ? newest : 0] ?? QUALITIES[0];
    /** @type {EastNorth} */
    const place = [track.e_m[i], track.n_m[i]];
    if (ink !== pieces.at(-1)?.ink) {
      const end = pieces.at(-1)?.points.at(-1);
      pieces.push({ points: end ? [end] : [], ink, dash: ink === "muted" ? [6, 4] : [], width: 4 });
    }
    pieces.at(-1)?.points.push(place);
  });
  return pieces;
}

/**
 * Where the tip stood, on the mean of each landing.
 * @param {import("../sessions/track.js").Track} track
 * @param {Line | undefined} stance
 * @returns {EastNorth[]}
 */
export function landed(track, stance) {
  if (!stance) return [];
  const high = stance.high ?? stance.low;
  /** @type {EastNorth[]} */
  const places = [];
  /** @type {EastNorth[]} */
  let standing = [];
  track.t_s.forEach((t_s, i) => {
    if (high[Math.floor((t_s - stance.start_s) / stance.step_s)] === 1) standing.push([track.e_m[i], track.n_m[i]]);
    else if (standing.length > 0) {
      places.push(middle(standing));
      standing = [];
    }
  });
  return standing.length > 0 ? [...places, middle(standing)] : places;
}

/** @param {EastNorth[]} places @returns {EastNorth} */
function middle(places) {
  const sum = places.reduce(([e, n], [de, dn]) => /** @type {EastNorth} */ ([e + de, n + dn]));
  return [sum[0] / places.length, sum[1] / places.length];
}

/** The ellipses of the way, one every some seconds. @param {import("../sessions/track.js").Track} track */
function alongTheWay({ t_s, e_m, n_m, more }) {
  /** @type {import("../map/runs.js").RunLine[]} */
  const rings = [];
  let next_s = -Infinity;
  t_s.forEach((at_s, i) => {
    if (at_s < next_s || !(more.sigma_e_m?.[i] >= 0)) return;
    next_s = at_s + ELLIPSE_S;
    rings.push(ring([e_m[i], n_m[i]], more.sigma_e_m[i], more.sigma_n_m[i], "runB"));
  });
  return rings;
}

/**
 * A 95 % ellipse, larger than it is.
 * @param {EastNorth} place
 * @param {number} sigmaE m
 * @param {number} sigmaN m
 * @param {string} ink
 * @returns {import("../map/runs.js").RunLine}
 */
function ring([e, n], sigmaE, sigmaN, ink) {
  const corner = (/** @type {number} */ k) => {
    const turn = (2 * Math.PI * k) / CORNERS;
    return /** @type {EastNorth} */ ([
      e + LARGER * K95 * sigmaE * Math.cos(turn),
      n + LARGER * K95 * sigmaN * Math.sin(turn),
    ]);
  };
  return { points: Array.from({ length: CORNERS + 1 }, (_, k) => corner(k)), ink, dash: [], width: 1.4 };
}

/**
 * The points with their sigmas, and what can be done with them.
 * @param {string} id of the session
 * @param {SurveyedPoint[]} points
 */
function pointTable(id, points) {
  if (points.length === 0) return html`<p class="muted">${t("pole.no_points")}</p>`;
  const three = (/** @type {number[]} */ metres) => metres.map((m) => html`<td class="num mono">${number(m, 3)}</td>`);
  return html`<h3>${t("pole.points")}</h3>
    <div class="scroll" tabindex="0" role="region" aria-label="${t("pole.points")}">
      <table data-testid="surveyed-points">
        <thead>
          <tr>
            <th>${t("session.marker")}</th>
            <th class="num">ΔE</th>
            <th class="num">ΔN</th>
            <th class="num">ΔU</th>
            <th class="num">σE</th>
            <th class="num">σN</th>
            <th class="num">σU</th>
            <th class="num">${t("pole.visits")}</th>
            <th class="num">${t("pole.apart")}</th>
          </tr>
        </thead>
        <tbody>
          ${points.map(
            (point) =>
              html`<tr>
                <td>${point.marker}</td>
                ${point.off_m ? three(point.off_m) : html`<td colspan="3">${t("pole.new_point")}</td>`}${three(point.sigma_m)}
                <td class="num">${point.visits}</td>
                <td class="num mono">${point.visits > 1 ? number(point.visits_apart_m, 3) : "–"}</td>
              </tr>`,
          )}
        </tbody>
      </table>
    </div>
    <p class="muted">${t("pole.points_explain")}</p>
    <p class="row">
      <a class="button" href="#/markers/survey-${id}" data-testid="import-survey">${t("pole.import")}</a>
      ${/** @type {const} */ (["csv", "txt", "xml"]).map((format) => html`<a class="button" href="/api/v1/sessions/${id}/surveyed-points.${format}" download>${t(`pole.file.${format}`)}</a>`)}
    </p>`;
}
