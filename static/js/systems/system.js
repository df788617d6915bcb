// What a system of the page has. Types alone: no page asks for this file.

/**
 * One stream of a session, as somebody hands its log in.
 * @typedef {{
 *   stream: string, id: string, kind: "imu" | "values", required: boolean, columns: {name: string, required: boolean}[],
 * }} UploadSlot `id` names its card for tests; the server looks at a log of `imu` beforehand, of `values` the columns are named, each with its unit at the end
 */

/**
 * A figure at the cursor of a replay, which only this system has. `point` is a column of the track at the cursor, NaN for an empty
 * field and null when no point is close to the cursor; `chart` is the value of a chart's line there, null in a hole.
 * @typedef {{point: (column: string) => number | null, chart: (chart: string, series: string) => number | null}} Moment
 * @typedef {{name: string, charts: string[], words: (moment: Moment) => string}} Readout
 */

/**
 * @typedef {{
 *   lines: import("../map/runs.js").RunLine[], places: import("../map/runs.js").RunCursor[], legend: {ink: string, words: string}[],
 *   card: (t_s: number) => ReturnType<typeof import("../html.js").html>,
 * }} Overlay lines over the track, places with their words, keys for both; and what stands at the side, at the time of the cursor
 */

/**
 * @typedef {{
 *   name: string, carrierKind: string, icon: string,
 *   uploadSlots: UploadSlot[], exchangeable: boolean, slotOf: (fileName: string) => string | null,
 *   instrument: {about: string, example: string} | null, placesItself: boolean,
 *   sessionBody: (streams: string[]) => Record<string, unknown>, logBody: (stream: string) => Record<string, unknown>,
 *   streamOf: (row: any) => string | null,
 *   parts: {name: string, ink: string}[], pointColumns: string[],
 *   aids: string[], ladder: string[][],
 *   plots: (kit: typeof import("../replay/plots.js")) => import("../replay/plots.js").Plot[],
 *   plotGroups: string[], firstPlotGroups: string[],
 *   readouts: Readout[], reportFigures: (report: any) => {value: string, label: string}[],
 *   overlay?: (id: string, track: import("../sessions/track.js").Track) => Promise<Overlay>,
 *   clients: (() => Promise<{clients: (origin: string) => [string, string][]}>) | null,
 *   plan?: () => ReturnType<typeof import("../html.js").html>,
 *   board?: () => Promise<typeof import("./cabin_board.js")>,
 *   words: Record<string, string>,
 * }} System
 *
 * `name`             as sessions name it
 * `carrierKind`      what is positioned, such as `person`
 * `icon`             the disc of its sign on the map: SVG about the origin, within 9 units of it, of class `disc`
 * `uploadSlots`      the streams to hand in, in order
 * `exchangeable`     whether its two logs are easily mistaken for each other: then they can be exchanged
 * `slotOf`           the stream that a file's name tells; null when it tells none
 * `instrument`       what is asked of it, with an example in TOML
 * `placesItself`     whether its streams say where it is: nobody is asked for a start, a first heading or visits
 * `sessionBody`      what `POST /sessions` is told of the system and the streams that there are logs of
 * `logBody`          what `POST /sessions/{id}/logs` is told of the stream
 * `streamOf`         the stream that a row of the server (log, anomaly, input) is of; null: of none
 * `parts`            what has a place of its own beside the carrier's, and its ink
 * `pointColumns`     columns of a track that are read beside those of every system
 * `aids`, `ladder`   what helps the filter, in the order in which it is built up; and steps of it worth showing
 * `plots`            the charts of a replay, made of the kit that the replay brings along
 * `plotGroups`, …    groups of charts to switch, and those shown at first
 * `readouts`         more figures at the cursor
 * `reportFigures`    more figures of the report
 * `overlay`          what a session shows on its map and beside it, beyond the track
 * `plan`             what to expect before a session, shown where one is handed in
 * `clients`          example programs for the page of the API
 * `board`            what it shows of a session beside the map, of the moment of the replay or live
 * `words`            what the server's declaration says, by key, where the page has no message
 */

export {};
