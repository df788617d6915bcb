import assert from "node:assert/strict";
import { test } from "node:test";
import * as kit from "../js/replay/plots.js";
import { generic } from "../js/systems/generic.js";
import { refined } from "../js/systems/cabin.js";
import { changesOf, together } from "../js/systems/cabin_changes.js";
import { frameBytes, readFrame } from "../js/systems/cabin_frame.js";
import { momentOf } from "../js/systems/cabin_moment.js";
import { cellAt } from "../js/systems/cabin_times.js";
import { groupsOf, stationsOf, whyOut } from "../js/systems/cabin_why.js";

const DECLARED = generic({
  name: "cabin",
  title: "Cabin",
  carrier_kind: "cabin",
  places_itself: true,
  streams: [{ name: "imu", role: "imu", title: "Sensor", kind: "imu", columns: [], least: 1, most: 1 }],
  parts: ["cabin", "platform"].map((name) => ({ name, title: name })),
  aids: [{ name: "antennas" }, { name: "stations" }],
  charts: [],
  anomalies: [],
});

test("the cabin's charts hold measured against planned, in millimetres, for both bodies", () => {
  const cabin = refined(DECLARED);
  const plots = cabin.plots(kit);
  assert.equal(new Set(plots.map(({ id }) => id)).size, plots.length);
  assert.ok(plots.every(({ group }) => cabin.plotGroups.includes(group)));
  const off = plots.find(({ id }) => id === "off_plan_platform");
  assert.deepEqual(
    [off?.unit, off?.factor, off?.lines.map(({ series }) => series)],
    ["mm", 1000, ["platform_e", "platform_n", "platform_u"]],
  );
  assert.deepEqual(
    plots.filter(({ group }) => group === "innovations").map(({ id }) => id),
    ["nis_antennas", "nis_stations"],
  );
});

test("a frame of the poses is read as docs/poses.md lays it out, and nothing else is one", () => {
  const bytes = new ArrayBuffer(frameBytes(2));
  const view = new DataView(bytes);
  "LPOS".split("").forEach((letter, i) => view.setUint8(i, letter.charCodeAt(0)));
  view.setUint16(4, 2, true);
  view.setUint8(30, 2);
  view.setUint8(31, 2);
  view.setBigInt64(16, 12_345_000_000n, true);
  view.setUint32(24, 2500, true);
  view.setUint8(28, 2);
  view.setBigUint64(32, 0b101n, true);
  [1.5, -2.5, 140, 0.1, 0.2, 0.3].forEach((value, i) => view.setFloat64(40 + 8 * i, value, true));
  view.setFloat32(40 + 112, 0.5, true);
  view.setFloat32(40 + 120, 0.25, true);
  view.setUint32(40 + 128, 1 | 2 | 4 | 16, true);
  view.setUint16(304, 65535, true);
  view.setUint16(308, 250, true);
  view.setUint16(310, 7, true);
  const frame = readFrame(bytes);
  assert.deepEqual(
    [frame?.t_s, frame?.age_s, frame?.state, frame?.aids, frame?.bodies[1]],
    [12.345, 0.0025, 2, 0b101n, null],
  );
  const body = frame?.bodies[0];
  assert.deepEqual([body?.place_m, body?.angles_rad, body?.level_m], [[1.5, -2.5, 140], [0.1, 0.2, 0.3], 0.25]);
  assert.deepEqual([body?.valid, body?.measured, body?.alarm, body?.near], [true, true, false, true]);
  assert.equal(body?.off_rad[1], 0.5);
  assert.deepEqual(frame?.states, [
    { since_s: Infinity, trouble: 0 },
    { since_s: 2.5, trouble: 7 },
  ]);
  assert.equal(readFrame(bytes.slice(0, 308)), null);
  view.setUint8(0, 0);
  assert.equal(readFrame(bytes), null);
  assert.equal(readFrame(new ArrayBuffer(8)), null);
});

test("the stations are found in the instrument's file", () => {
  const file = `[antennas]\nnames = ["A1", "A2"]\nmake = [ "L", # base station\n"B" ]\nposition_b = [\n  [1, 2, 3],\n]\n[stations]\nnames = ["S1", "S2"]\nposition_n = [\n  [10.5, -20, -3],\n  [-1e1, 7, 0.5],\n]\nposition_sigma_m = 0.001\n\n[rotator]\n`;
  assert.deepEqual(stationsOf(file), [
    { name: "S1", e_m: 10.5, n_m: -20 },
    { name: "S2", e_m: -10, n_m: 7 },
  ]);
  assert.deepEqual(stationsOf(null), []);
  assert.deepEqual(
    [...groupsOf(file)],
    [
      ["A1", ["L", "antennas"]],
      ["A2", ["B", "antennas"]],
      ["S1", ["stations"]],
      ["S2", ["stations"]],
    ],
  );
});

test("a cell of the aids tells why its device was shut out at that time", () => {
  const canvas = /** @type {any} */ ({ getBoundingClientRect: () => ({ width: 662 }) });
  const rows = ["", "", "imu", "A1", "S2"];
  const cell = cellAt(canvas, { rows, now_s: 1000 }, 370, 50);
  assert.equal(cell?.name, "S2");
  assert.ok(Math.abs((cell?.t_s ?? 0) - 704.054) < 0.001);
  assert.equal(cellAt(canvas, { rows: ["imu"], now_s: 1000 }, 370, 50), null);
  const found = (/** @type {string} */ device, /** @type {string} */ anomaly, from_s = 690, to_s = 710) => ({
    anomaly,
    figures: { device },
    detail: `${device}: off`,
    t_start_ns: from_s * 1e9,
    t_end_ns: to_s * 1e9,
  });
  const anomalies = [found("S2", "of_one"), found("stations", "of_all"), found("S1", "of_another")];
  anomalies.push(found("S2", "before", 600, 650), found("antennas", "of_others"));
  const groups = new Map([
    ["S2", ["stations"]],
    ["A1", ["L", "antennas"]],
  ]);
  assert.equal(whyOut(anomalies, groups, { name: "S2", t_s: 700 }), "S2 · of_one · of_all");
  assert.equal(whyOut(anomalies, groups, { name: "S3", t_s: 720 }), "S3");
  assert.equal(whyOut([found("L", "of_make")], groups, { name: "A1", t_s: 700 }), "A1 · of_make");
  assert.equal(whyOut([found("leg_3", "of_leg")], groups, { name: "encoders", t_s: 700 }), "encoders · of_leg");
});

/**
 * A moment of the last minutes.
 * @param {number} t_s
 * @param {boolean[]} aids
 * @param {number} state
 * @param {number} source
 */
const moment = (t_s, aids, state = 1, source = 1) => ({
  ...{ t_s, aids, state, source },
  ...{ off_m: [null, null], sigma_m: [0.001, 0.001], off_rad: [null, null], sigma_rad: [0, 0] },
});

test("changes of what corrects the pose are told the newest first, those of one event together", () => {
  const names = ["A1", "S1", "S2", "S3"];
  const [all, fog] = [
    [true, true, true, true],
    [true, false, false, false],
  ];
  const past = [moment(0, all), moment(1, all), moment(2, [true, false, true, true]), moment(3, fog, 2)];
  past.push(moment(50, fog, 2), moment(51, all, 1, 2));
  assert.deepEqual(changesOf(past, names, 9), [
    { t_s: 51, gone: [], back: ["S1", "S2", "S3"], state: 1, source: 2 },
    { t_s: 2, gone: ["S1", "S2", "S3"], back: [], state: 2, source: null },
  ]);
  assert.equal(changesOf(past, names, 1).length, 1);
  // What comes back at once is a change of its own.
  const blinked = [moment(0, all), moment(1, fog), moment(2, all)];
  assert.equal(changesOf(blinked, names, 9).length, 2);
  assert.equal(together(["S1", "S3", "S2", "encoders", "A1", "A10", "A9"]), "A1, A9, A10, S1–S3, encoders");
});

test("the moment of a replay is made of the charts before it and the track", () => {
  const line = (/** @type {string} */ chart, /** @type {string} */ series, /** @type {(number | null)[]} */ low) => ({
    ...{ chart, series, low },
    ...{ start_s: 98, step_s: 1 },
  });
  const series = [
    ...[line("sigma_body", "cabin", [0.001, 0.006]), line("sigma_body", "platform", [0.001, 0.0009])],
    ...[line("state", "cabin", [1, 3]), line("source", "platform", [1, 3]), line("time_left", "cabin", [null, 12])],
    ...[line("aids", "encoders", [1, 0]), line("aids", "A1", [1, 1]), line("aids", "imu", [1, 1])],
    ...["e", "n", "u"].map((axis) => line("off_plan", `cabin_${axis}`, [0.01, 0.02])),
    ...["yaw", "pitch", "roll"].map((angle) => line("platform_angles", angle, [0.1, 0.2])),
  ];
  const at = (/** @type {number} */ value) => Float64Array.of(value, value);
  const more = {
    pitch_rad: at(0.02),
    roll_rad: at(0.03),
    platform_e_m: at(1),
    platform_n_m: at(2),
    platform_u_m: at(3),
  };
  const track = {
    t_s: Float64Array.of(98.5, 99.5),
    e_m: at(10),
    n_m: at(20),
    u_m: at(140),
    heading_rad: at(0.5),
    more,
  };
  const { names, past, frame } = momentOf({ series }, /** @type {any} */ (track), 100);
  assert.deepEqual(names, ["imu", "A1", "encoders"]);
  assert.deepEqual(
    past.map(({ t_s, aids, off_m }) => [t_s, aids, off_m]),
    [
      [98.5, [true, true, true], [[0.01, 0.01, 0.01], null]],
      [99.5, [true, true, false], [[0.02, 0.02, 0.02], null]],
    ],
  );
  const [cabin, platform] = frame.bodies;
  assert.deepEqual([frame.state, cabin?.alarm, cabin?.left_s, cabin?.place_m], [3, true, 12, [10, 20, 140]]);
  assert.deepEqual([platform?.measured, platform?.near, platform?.angles_rad], [false, true, [0.2, 0.2, 0.2]]);
});
