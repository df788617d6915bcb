// What the mock says of a log before it is handed in: by its header alone, with figures that stand still.

/**
 * @param {string} text the beginning of the log
 * @param {boolean} part
 * @param {any} reading
 */
export function previewOf(text, part, reading) {
  const lines = text.split("\n");
  const columns = lines[0].split(",");
  const rows = lines
    .slice(1, 5)
    .filter(Boolean)
    .map((line) => line.split(","));
  const canonical = columns.includes("gyr_x_rad_s");
  const x_io = columns.includes("Gyroscope X (deg/s)");
  const mapped = Boolean(reading.mapping);
  const known = canonical || x_io || mapped;
  return {
    format: canonical ? "canonical" : x_io ? "x_io" : mapped ? "mapped" : null,
    mapping: mapped ? reading.mapping : null,
    notes: [],
    delimiter: "comma",
    columns,
    rows,
    clock_ns: known ? [x_io ? 7e9 : 0, 120e9] : null,
    part,
    field_in_counts: false,
    survey: survey(known),
    problem: known
      ? null
      : {
          type: "about:blank",
          title: "Unprocessable Entity",
          status: 422,
          code: columns.length > 5 ? "unknown_format" : "missing_column",
          detail: "expected a log in a known format, found another table",
        },
  };
}

function survey(/** @type {boolean} */ known) {
  const bins = known ? 120 : 0;
  const swing = (/** @type {number} */ i, /** @type {number} */ rest, /** @type {number} */ most) => [
    rest,
    i > 20 && i % 3 === 0 ? most : rest,
  ];
  return {
    samples: known ? 12_000 : 0,
    t_first_s: 0,
    t_last_s: 120,
    duration_s: 120,
    rate_hz: 100,
    gaps: known ? 1 : 0,
    gaps_s: 0.31,
    first_gaps: [{ t_s: 61.2, length_s: 0.31 }],
    repeated_times: 0,
    backward_times: 0,
    clipped_rates: 0,
    clipped_forces: 0,
    largest_rate_rad_s: 8.1,
    largest_force_m_s2: 31,
    still_s: 11.4,
    field_share: 1,
    field_mean_ut: 47.9,
    pressure_share: 0,
    first_rows: known ? [[0, 0.01, 0, 0, 0.1, 0.2, 9.79, 20, -5, 41, null]] : [],
    chart: {
      t_first_s: 0,
      step_s: 1,
      rate_rad_s: Array.from({ length: bins }, (_, i) => swing(i, 0.02, 7.5)),
      force_m_s2: Array.from({ length: bins }, (_, i) => swing(i, 9.8, 28)),
    },
  };
}
