import assert from "node:assert/strict";
import { test } from "node:test";
import * as kit from "../js/replay/plots.js";
import { generic } from "../js/systems/generic.js";
import { refined } from "../js/systems/cabin.js";
import { FRAME_BYTES, readFrame } from "../js/systems/cabin_frame.js";
import { stationsOf, whyOut } from "../js/systems/cabin_board.js";
import { aidAt } from "../js/systems/cabin_drawing.js";

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
  const bytes = new ArrayBuffer(FRAME_BYTES);
  const view = new DataView(bytes);
  "LPOS".split("").forEach((letter, i) => view.setUint8(i, letter.charCodeAt(0)));
  view.setUint16(4, 1, true);
  view.setBigInt64(16, 12_345_000_000n, true);
  view.setUint32(24, 2500, true);
  view.setUint8(28, 2);
  view.setBigUint64(32, 0b101n, true);
  [1.5, -2.5, 140, 0.1, 0.2, 0.3].forEach((value, i) => view.setFloat64(40 + 8 * i, value, true));
  view.setFloat32(40 + 108, 0.25, true);
  view.setUint32(40 + 116, 1 | 2 | 4 | 16, true);
  const frame = readFrame(bytes);
  assert.deepEqual(
    [frame?.t_s, frame?.age_s, frame?.state, frame?.aids, frame?.bodies[1]],
    [12.345, 0.0025, 2, 0b101n, null],
  );
  const body = frame?.bodies[0];
  assert.deepEqual([body?.place_m, body?.angles_rad, body?.level_m], [[1.5, -2.5, 140], [0.1, 0.2, 0.3], 0.25]);
  assert.deepEqual([body?.valid, body?.measured, body?.alarm, body?.near], [true, true, false, true]);
  view.setUint8(0, 0);
  assert.equal(readFrame(bytes), null);
  assert.equal(readFrame(new ArrayBuffer(8)), null);
});

test("the stations are found in the instrument's file", () => {
  const file = `[antennas]\nnames = ["A1"]\nposition_b = [\n  [1, 2, 3],\n]\n[stations]\nnames = ["S1", "S2"]\nposition_n = [\n  [10.5, -20, -3],\n  [-1e1, 7, 0.5],\n]\nposition_sigma_m = 0.001\n\n[rotator]\n`;
  assert.deepEqual(stationsOf(file), [
    { name: "S1", e_m: 10.5, n_m: -20 },
    { name: "S2", e_m: -10, n_m: 7 },
  ]);
  assert.deepEqual(stationsOf(null), []);
});

test("a cell of the aids tells why its device was shut out at that time", () => {
  const canvas = /** @type {any} */ ({ getBoundingClientRect: () => ({ width: 662 }) });
  const cell = aidAt(canvas, { names: ["imu", "A1", "S2"], now_s: 1000 }, 362, 25);
  assert.deepEqual(cell, { name: "S2", t_s: 700 });
  assert.equal(aidAt(canvas, { names: ["imu"], now_s: 1000 }, 362, 25), null);
  const found = (/** @type {string} */ device, /** @type {string} */ anomaly, from_s = 690, to_s = 710) => ({
    anomaly,
    figures: { device },
    detail: `${device}: off`,
    t_start_ns: from_s * 1e9,
    t_end_ns: to_s * 1e9,
  });
  const anomalies = [found("S2", "of_one"), found("stations", "of_all"), found("S1", "of_another")];
  anomalies.push(found("S2", "before", 600, 650), found("antennas", "of_others"));
  assert.equal(whyOut(anomalies, { name: "S2", t_s: 700 }), "S2 · of_one · of_all");
  assert.equal(whyOut(anomalies, { name: "S3", t_s: 720 }), "S3");
});
