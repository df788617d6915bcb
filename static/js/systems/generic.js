// A system that the page has no file for, shown by nothing but what the server declares of it: a log for each stream, a point
// with trail and ellipse on the map, charts with one line each series.

/**
 * @typedef {{
 *   name: string, role: string, title: string, kind: "imu" | "values", least: number, most: number,
 *   columns: {name: string, required: boolean}[],
 * }} StreamDeclaration streams of one role: from `least` to `most`, called NAME_1, NAME_2 and so on where there may be several
 * @typedef {{
 *   name: string, title: string, carrier_kind: string, streams: StreamDeclaration[], parts: {name: string, title: string}[],
 *   instrument?: {about: string, example: string} | null, places_itself?: boolean,
 *   aids: {name: string}[], charts: {name: string, unit: string}[], anomalies: string[],
 * }} Declaration of one system, as `GET /systems` lists them
 */

/** Inks of lines and parts, one after the other. */
const INKS = ["0", "1", "3", "5", "4", "6"];

/**
 * @param {Declaration} declaration
 * @returns {import("./index.js").System}
 */
export function generic(declaration) {
  const {
    name,
    title,
    carrier_kind,
    streams: rules,
    instrument,
    places_itself,
    parts,
    aids,
    charts,
    anomalies,
  } = declaration;
  const streams = rules.flatMap(each);
  const names = aids.map((aid) => aid.name);
  return {
    name,
    carrierKind: carrier_kind,
    icon: `<rect class="disc" x="-7" y="-7" width="14" height="14"/>`,
    uploadSlots: streams.map((stream) => ({
      stream: stream.name,
      id: `stream-${stream.name}`,
      kind: stream.kind,
      required: stream.required,
      // A log of an inertial sensor may be of many formats.
      columns: stream.kind === "values" ? stream.columns : [],
    })),
    exchangeable: streams.length === 2 && streams.every(({ kind, role }) => kind === "imu" && role === streams[0].role),
    slotOf: (fileName) => namedIn(fileName.toLowerCase(), streams),
    instrument: instrument ?? null,
    placesItself: places_itself ?? false,
    sessionBody: (handedIn) => ({ system: name, streams: handedIn }),
    logBody: (stream) => ({ stream }),
    streamOf: (row) => row.stream ?? null,
    parts: parts.map((part, i) => ({ name: part.name, ink: INKS[i % INKS.length] })),
    pointColumns: [],
    aids: names,
    ladder: names.map((_, n) => names.slice(0, n + 1)),
    plots: (kit) => plots(kit, names, charts, [...streams, ...parts]),
    plotGroups: ["motion", "measured", "heading", "sigma", "innovations", "height"],
    firstPlotGroups: ["motion", "measured", "sigma", "height"],
    readouts: [],
    reportFigures: () => [],
    clients: null,
    words: Object.fromEntries([
      ["title", title],
      ...parts.map((part) => [`stream.${part.name}`, part.title]),
      ...streams.map((stream) => [`stream.${stream.name}`, stream.title]),
      ...charts.map((chart) => [`plot.${chart.name}`, said(chart.name)]),
      ...names.flatMap((aid) => [
        [`aid.${aid}`, said(aid)],
        [`plot.nis_${aid}`, `NIS, ${said(aid)}`],
      ]),
      ...anomalies.map((kind) => [`anomaly.${kind}`, said(kind)]),
    ]),
  };
}

/**
 * The streams that a session may have of one role.
 * @param {StreamDeclaration} rule
 */
function each(rule) {
  const count = Array.from({ length: rule.most }, (_, k) => k + 1);
  return count.map((k) => ({
    ...rule,
    name: rule.most > 1 ? `${rule.name}_${k}` : rule.name,
    title: rule.most > 1 ? `${rule.title} ${k}` : rule.title,
    required: k <= rule.least,
  }));
}

/** A name as it is read. @param {string} name */
const said = (name) => name.replaceAll("_", " ");

/**
 * The stream that is named in a file's name; null for none or several.
 * @param {string} fileName
 * @param {{name: string}[]} streams
 */
function namedIn(fileName, streams) {
  const found = streams.filter((stream) => fileName.includes(stream.name.toLowerCase()));
  return found.length === 1 ? found[0].name : null;
}

/**
 * What every system has, and the rest of the declared charts in their own units. Which lines these have is not declared: every
 * stream and part may have one, and the track's runs; those that are not there do not show.
 * @param {typeof import("../replay/plots.js")} kit
 * @param {string[]} aids
 * @param {Declaration["charts"]} charts
 * @param {{name: string}[]} lines that they may have beside those of the runs
 * @returns {import("../replay/plots.js").Plot[]}
 */
function plots({ COMMON, innovations, runs }, aids, charts, lines) {
  const { speed, height, markers, ...others } = COMMON;
  const weighed = aids.map(innovations).filter(({ id }) => id !== markers.id);
  const common = [speed, ...Object.values(others), ...weighed, markers, height];
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
        lines: [
          ...lines.map(({ name }, i) => ({
            chart: chart.name,
            series: name,
            label: `stream.${name}`,
            ink: INKS[i % INKS.length],
          })),
          ...runs(chart.name),
        ],
      })),
  ];
}
