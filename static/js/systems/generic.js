// A system that the page has no file for, shown by nothing but what the server declares of it: a log for each stream, a point
// with trail and ellipse on the map, charts with one line each series.

/**
 * @typedef {{
 *   number: number, name: string, role: string, kind: "imu" | "values", least: number, most: number,
 *   columns?: {name: string, unit: string, required: boolean}[],
 * }} StreamDeclaration `least`: how many of these a session must have, 0 or 1; `columns` of a kind `values`
 * @typedef {{
 *   name: string, title: string, carrier_kind: string, streams: StreamDeclaration[], parts: {number: number, name: string}[],
 *   aids: {name: string, title: string, degrees_of_freedom?: number, gate?: number | null}[],
 *   charts: {name: string, unit: string, lines: string[]}[], anomalies: {kind: string, sentence: string}[],
 * }} Declaration of one system, as `GET /systems` lists them
 */

/** Inks of lines and parts, one after the other. */
const INKS = ["0", "1", "3", "5", "4", "6"];

/**
 * @param {Declaration} declaration
 * @returns {import("./index.js").System}
 */
export function generic({ name, title, carrier_kind, streams, parts, aids, charts, anomalies }) {
  const names = aids.map((aid) => aid.name);
  return {
    name,
    carrierKind: carrier_kind,
    icon: `<rect class="disc" x="-7" y="-7" width="14" height="14"/>`,
    uploadSlots: streams.map((stream) => ({
      stream: stream.name,
      id: `stream-${stream.name}`,
      kind: stream.kind,
      required: stream.least > 0,
      columns: stream.columns ?? [],
    })),
    exchangeable: streams.length === 2 && streams.every(({ kind, role }) => kind === "imu" && role === streams[0].role),
    slotOf: (fileName) => namedIn(fileName.toLowerCase(), streams),
    sessionBody: (handedIn) => ({ system: name, streams: handedIn }),
    logBody: (stream) => ({ stream }),
    streamOf: (row) => row.stream ?? null,
    parts: parts.map((part, i) => ({ name: part.name, ink: INKS[i % INKS.length] })),
    pointColumns: [],
    aids: names,
    ladder: names.map((_, n) => names.slice(0, n + 1)),
    plots: (kit) => plots(kit, names, charts),
    plotGroups: ["motion", "measured", "heading", "sigma", "innovations", "height"],
    firstPlotGroups: ["motion", "measured", "sigma", "height"],
    readouts: [],
    reportFigures: () => [],
    clients: null,
    words: Object.fromEntries([
      ["title", title],
      ...streams.map((stream) => [`stream.${stream.name}`, said(stream.name)]),
      ...charts.map((chart) => [`plot.${chart.name}`, said(chart.name)]),
      ...aids.flatMap((aid) => [
        [`aid.${aid.name}`, aid.title],
        [`plot.nis_${aid.name}`, `NIS, ${aid.title}`],
      ]),
      ...anomalies.flatMap(({ kind, sentence }) => [
        [`anomaly.${kind}`, said(kind)],
        [`anomaly.about.${kind}`, sentence],
      ]),
    ]),
  };
}

/** A name as it is read. @param {string} name */
const said = (name) => name.replaceAll("_", " ");

/**
 * The stream that is named in a file's name; null for none or several.
 * @param {string} fileName
 * @param {StreamDeclaration[]} streams
 */
function namedIn(fileName, streams) {
  const found = streams.filter((stream) => fileName.includes(stream.name.toLowerCase()));
  return found.length === 1 ? found[0].name : null;
}

/**
 * What every system has, and the rest of the declared charts in their own units.
 * @param {typeof import("../replay/plots.js")} kit
 * @param {string[]} aids
 * @param {Declaration["charts"]} charts
 * @returns {import("../replay/plots.js").Plot[]}
 */
function plots({ COMMON, innovations }, aids, charts) {
  const { speed, height, markers, ...others } = COMMON;
  const common = [speed, ...Object.values(others), ...aids.map(innovations), markers, height];
  const drawn = new Set(common.map(({ id }) => id));
  return [
    ...common,
    ...charts
      .filter((chart) => !drawn.has(chart.name))
      .map((chart) => ({
        id: chart.name,
        group: "measured",
        title: `plot.${chart.name}`,
        unit: chart.unit === "1" ? "" : chart.unit,
        factor: 1,
        digits: 2,
        lines: chart.lines.map((line, i) => ({
          chart: chart.name,
          series: line,
          label: `stream.${line}`,
          ink: INKS[i % INKS.length],
        })),
      })),
  ];
}
