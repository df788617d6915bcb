// What the server says of a log before anything of it is kept, and what follows from that.

/**
 * @typedef {{columns: [string, string, string], unit: string, one_is?: number}} Axes
 * @typedef {{
 *   delimiter?: string, time: {column?: string, unit?: string, rate_hz?: number, wraps_at?: number},
 *   gyr: Axes, acc: Axes, mag?: Axes, pressure?: {column: string, unit: string}, skip_rows_without_inertial?: boolean,
 * }} Mapping which column is which channel, as docs/wire.md has it
 * @typedef {{mapping?: Mapping, rate_hz?: number, field_ut_per_count?: number, clock_zero_ns?: number}} Reading
 * @typedef {{id: string, name: string, mapping: Mapping}} NamedMapping
 * @typedef {{
 *   samples: number, t_first_s: number, t_last_s: number, duration_s: number, rate_hz: number | null, gaps: number, gaps_s: number,
 *   first_gaps: {t_s: number, length_s: number}[], repeated_times: number, backward_times: number, clipped_rates: number, clipped_forces: number,
 *   largest_rate_rad_s: number, largest_force_m_s2: number, still_s: number, field_share: number, field_mean_ut: number | null, pressure_share: number,
 *   first_rows: (number | null)[][],
 *   chart: {t_first_s: number, step_s: number, rate_rad_s: ([number, number] | null)[], force_m_s2: ([number, number] | null)[]},
 * }} Survey
 * @typedef {{
 *   format: string | null, mapping: Mapping | null, suggestion?: Mapping | null, notes: string[], delimiter: string | null, columns: string[], rows: string[][],
 *   clock_ns: [number, number] | null, part: boolean, field_in_counts: boolean, survey: Survey,
 *   problem: {detail: string, code: string, status: number, where?: Record<string, unknown>} | null,
 * }} Preview
 */

/** The beginning of a log tells all but its gaps; more is only sent with the upload. */
export const PART_BYTES = 4 << 20;
/** The engine aligns on a stand of about this length, s. */
export const STAND_S = 10;
/** A magnetic field outside of these is no field of the Earth, µT. */
export const FIELD_UT = /** @type {const} */ ([20, 80]);
/** Clocks that differ by more are not one clock, ns. */
const ONE_CLOCK_NS = 3.6e12;

/**
 * @param {Pick<typeof import("../api.js"), "previewLog">} api
 * @param {File} file
 * @param {Reading} reading
 */
export function look(api, file, reading) {
  const part = file.size > PART_BYTES;
  return api.previewLog(part ? file.slice(0, PART_BYTES) : file, part, reading);
}

/**
 * Whether a log is a table of which somebody has to say which column is which: of another's names, or of none.
 * @param {Preview | null | undefined} preview
 */
export function asksForColumns(preview) {
  const code = preview?.problem?.code;
  return code === "unknown_format" || (code === "missing_header" && (preview?.columns.length ?? 0) > 0);
}

/**
 * The preset whose columns are all in this table, if there is just one like that.
 * @param {NamedMapping[]} presets
 * @param {Pick<Preview, "columns" | "delimiter">} table
 */
export function fittingPreset(presets, table) {
  const fits = presets.filter(
    ({ mapping }) =>
      (mapping.delimiter ?? "comma") === table.delimiter &&
      columnsOf(mapping).every((column) => table.columns.includes(column)),
  );
  return fits.length === 1 ? fits[0] : null;
}

/** @param {Mapping} mapping */
export function columnsOf(mapping) {
  return [
    mapping.time.column,
    ...mapping.gyr.columns,
    ...mapping.acc.columns,
    ...(mapping.mag?.columns ?? []),
    mapping.pressure?.column,
  ].filter((column) => column !== undefined);
}

/**
 * How logs lie in time. A canonical log counts from the session's start; another maker's shows its own clock, and those of one
 * clock begin together at the earliest first sample.
 * @param {Preview[]} previews
 * @returns {{one_clock: boolean, zero_ns: number | null, second_after_first_s: number, spread_s: number, overlap_s: number} | null}
 *   null for fewer than two logs, and where one of them tells no time
 */
export function logsInTime(previews) {
  const clocks = previews.flatMap(({ clock_ns }) => (clock_ns ? [clock_ns] : []));
  if (clocks.length < 2 || clocks.length < previews.length) return null;
  const canonical = previews.map((preview) => preview.format === "canonical");
  const begins = clocks.map(([first]) => first);
  const spread_ns = Math.max(...begins) - Math.min(...begins);
  const one_clock = canonical.every((is) => is === canonical[0]) && spread_ns <= ONE_CLOCK_NS;
  // Each counts from its own first sample otherwise.
  const first = begins.map((ns) => (one_clock ? ns : 0));
  const last = clocks.map(([from, to]) => (one_clock ? to : to - from));
  return {
    one_clock,
    zero_ns: one_clock && !canonical[0] ? Math.min(...begins) : null,
    second_after_first_s: (first[1] - first[0]) / 1e9,
    spread_s: one_clock ? spread_ns / 1e9 : 0,
    overlap_s: Math.max(0, (Math.min(...last) - Math.max(...first)) / 1e9),
  };
}

/**
 * What a person should look at before handing in, worst first.
 * @param {Preview} preview
 * @param {boolean} aligned whether the system is aligned by a stand
 * @returns {{key: string, values?: Record<string, string | number>}[]}
 */
export function warnings(preview, aligned) {
  const { survey } = preview;
  if (survey.samples === 0) return [];
  /** @type {{key: string, values?: Record<string, string | number>}[]} */
  const found = [];
  if (aligned && survey.still_s < STAND_S) found.push({ key: "still", values: { s: survey.still_s.toFixed(1) } });
  if (survey.gaps > 0) found.push({ key: "gaps", values: { gaps: survey.gaps, s: survey.gaps_s.toFixed(2) } });
  if (survey.clipped_rates + survey.clipped_forces > 0) {
    found.push({ key: "clipped", values: { samples: survey.clipped_rates + survey.clipped_forces } });
  }
  if (survey.repeated_times + survey.backward_times > 0) {
    found.push({ key: "times", values: { samples: survey.repeated_times + survey.backward_times } });
  }
  if (preview.field_in_counts) found.push({ key: "counts" });
  else if (
    survey.field_mean_ut !== null &&
    !(survey.field_mean_ut >= FIELD_UT[0] && survey.field_mean_ut <= FIELD_UT[1])
  ) {
    found.push({ key: "field", values: { ut: survey.field_mean_ut.toFixed(1) } });
  }
  return found;
}

/** Time left of something that has come so far; told only once that means something. */
export class TimeLeft {
  constructor(now = () => performance.now()) {
    this.now = now;
    /** @type {string | null} */
    this.what = null;
    this.begun_ms = 0;
    this.from = 0;
  }

  /**
   * @param {string} what a new thing begins anew
   * @param {number} done 0 to 1
   * @returns {number | null} seconds
   */
  of(what, done) {
    if (this.what !== what || done < this.from) {
      this.what = what;
      this.begun_ms = this.now();
      this.from = done;
      return null;
    }
    const spent_s = (this.now() - this.begun_ms) / 1000;
    const part = done - this.from;
    return spent_s < 1 || part < 0.01 ? null : (spent_s / part) * (1 - done);
  }
}
