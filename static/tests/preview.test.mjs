import assert from "node:assert/strict";
import { test } from "node:test";
import { setLanguage } from "../js/i18n.js";
import { guess, readMapping } from "../js/upload/mapping_form.js";
import { columnsOf, fittingPreset, logsInTime, look, PART_BYTES, TimeLeft, warnings } from "../js/upload/preview.js";

const survey = {
  samples: 100,
  still_s: 11,
  gaps: 0,
  gaps_s: 0,
  clipped_rates: 0,
  clipped_forces: 0,
  repeated_times: 0,
  backward_times: 0,
  field_mean_ut: 48,
};
/** @returns {any} */
const preview = (more = {}) => ({ format: "x_io", clock_ns: [0, 60e9], field_in_counts: false, survey, ...more });

test("only the beginning of a long log is sent to be looked at", async () => {
  const asked = [];
  /** @type {any} */
  const api = { previewLog: async (blob, part, reading) => asked.push([blob.size, part, reading]) };
  await look(api, new File([new Uint8Array(10)], "a"), { rate_hz: 100 });
  await look(api, new File([new Uint8Array(PART_BYTES + 1)], "b"), {});
  assert.deepEqual(asked, [
    [10, false, { rate_hz: 100 }],
    [PART_BYTES, true, {}],
  ]);
});

test("logs of one clock begin together at the earliest one", () => {
  const first = preview({ clock_ns: [1000e9, 1060e9] });
  const second = preview({ clock_ns: [1002e9, 1070e9] });
  const together = { one_clock: true, zero_ns: 1000e9, second_after_first_s: 2, spread_s: 2, overlap_s: 58 };
  assert.deepEqual(logsInTime([first, second]), together);
  const third = preview({ clock_ns: [995e9, 1030e9] });
  assert.deepEqual(logsInTime([first, second, third]), { ...together, zero_ns: 995e9, spread_s: 7, overlap_s: 28 });
  const canonical = logsInTime([first, second].map((log) => ({ ...log, format: "canonical" })));
  assert.deepEqual([canonical?.one_clock, canonical?.zero_ns], [true, null]);
  const apart = logsInTime([first, preview({ clock_ns: [9000e9, 9030e9] })]);
  assert.deepEqual(apart, { one_clock: false, zero_ns: null, second_after_first_s: 0, spread_s: 0, overlap_s: 30 });
  assert.equal(logsInTime([first, preview({ clock_ns: null })]), null);
  assert.equal(logsInTime([first]), null);
});

test("what should be looked at is said, worst first, and nothing of a good log", () => {
  const keys = (more, of = {}) => warnings(preview({ survey: { ...survey, ...more }, ...of }), true).map((w) => w.key);
  assert.deepEqual(keys({}), []);
  assert.deepEqual(keys({ still_s: 2, gaps: 3, clipped_forces: 9, repeated_times: 1, field_mean_ut: 480 }), [
    "still",
    "gaps",
    "clipped",
    "times",
    "field",
  ]);
  assert.deepEqual(keys({ field_mean_ut: 5443 }, { field_in_counts: true }), ["counts"]);
  assert.deepEqual(keys({ field_mean_ut: null }), []);
  assert.deepEqual(keys({ samples: 0, still_s: 0 }), []);
});

/** @type {any} */
const mapping = {
  delimiter: "comma",
  time: { column: "t", unit: "s" },
  gyr: { columns: ["gx", "gy", "gz"], unit: "deg_s" },
  acc: { columns: ["ax", "ay", "az"], unit: "g" },
};

test("a preset is used by itself where it is the only one that fits", () => {
  const columns = columnsOf(mapping);
  const presets = [{ id: "1", name: "one", mapping }];
  assert.equal(fittingPreset(presets, { columns: [...columns, "x"], delimiter: "comma" })?.id, "1");
  assert.equal(fittingPreset(presets, { columns, delimiter: "tab" }), null);
  assert.equal(fittingPreset(presets, { columns: columns.slice(1), delimiter: "comma" }), null);
  assert.equal(fittingPreset([...presets, { id: "2", name: "two", mapping }], { columns, delimiter: "comma" }), null);
});

test("columns are guessed by their names", () => {
  const found = guess([
    "time [ms]",
    "gyro_x",
    "gyro_y",
    "gyro_z",
    "acc_x",
    "acc_y",
    "acc_z",
    "mag_x",
    "mag_y",
    "mag_z",
    "pressure",
  ]);
  assert.deepEqual(
    [found.time, found.gyr_y, found.acc_z, found.mag_x, found.pressure],
    ["time [ms]", "gyro_y", "acc_z", "mag_x", "pressure"],
  );
  assert.deepEqual(guess(["secs", "wx", "wy", "wz", "fx", "fy", "fz"]).acc_x, "fx");
  assert.deepEqual(guess(["a", "b"]).gyr_x, undefined);
});

test("a mapping is read from its form, and what it lacks is said", async () => {
  setLanguage(
    "en",
    JSON.parse(
      await (await import("node:fs/promises")).readFile(new URL("../messages/en.json", import.meta.url), "utf8"),
    ),
  );
  const data = new FormData();
  for (const [channel, letter] of [
    ["gyr", "g"],
    ["acc", "a"],
  ])
    for (const axis of "xyz") data.set(`${channel}_${axis}`, letter + axis);
  for (const [name, value] of Object.entries({
    time: "t",
    time_unit: "s",
    gyr_unit: "deg_s",
    acc_unit: "g",
    rate_hz: "",
  }))
    data.set(name, value);
  assert.deepEqual(readMapping(data, "comma"), mapping);
  data.set("time", "");
  assert.throws(() => readMapping(data, "comma"), /sampling rate/);
  data.set("rate_hz", "100");
  assert.deepEqual(readMapping(data, "comma").time, { rate_hz: 100 });
  data.set("mag_x", "mx");
  assert.throws(() => readMapping(data, "comma"), /Magnetic field/);
});

test("time left is told once it means something, and begins anew with another thing", () => {
  let now = 0;
  const left = new TimeLeft(() => now);
  assert.equal(left.of("a", 0), null);
  now = 500;
  assert.equal(left.of("a", 0.2), null);
  now = 2000;
  assert.equal(left.of("a", 0.5), 2);
  assert.equal(left.of("b", 0.5), null);
});
