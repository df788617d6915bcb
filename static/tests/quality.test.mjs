import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { setLanguage } from "../js/i18n.js";
import { healthOf } from "../js/sessions/health.js";
import { system } from "../js/systems/pedestrian.js";
import { residualCard, residualsOf } from "../js/sessions/residuals.js";

const words = async (/** @type {string} */ file) =>
  JSON.parse(await readFile(new URL(`../messages/${file}.json`, import.meta.url), "utf8"));
const en = { ...(await words("en")), ...(await words("sessions.en")) };
const visit = (e_m, n_m, accepted = true) => ({
  session_id: "s",
  marker: "A1",
  t_start_ns: 0,
  t_end_ns: 0,
  accepted,
  before_minus_marker_m: [e_m, n_m, 0],
});

test("residuals at markers: mean, root mean square, 95 of 100, largest, and their distribution", () => {
  const found = residualsOf([visit(3, 4), visit(0, 1), visit(0, -2), visit(30, 40, false)]);
  assert.deepEqual(found, {
    count: 3,
    mean_m: 8 / 3,
    rms_m: Math.sqrt(10),
    largest_m: 5,
    within_95_m: 5,
    bin_m: 0.5,
    bins: [0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1],
  });
  const hundred = residualsOf(Array.from({ length: 100 }, (_, i) => visit(i + 1, 0)));
  assert.deepEqual([hundred.within_95_m, hundred.bins.reduce((a, b) => a + b, 0)], [95, 100]);
  assert.equal(residualsOf([visit(1, 1, false)]), null);
});

test("a walk whose largest residual is beyond the neighbouring actuator has not met what is asked", () => {
  setLanguage("en", en);
  assert.match(residualCard(residualsOf([visit(10.9, 0)])).text, /passed/);
  assert.match(residualCard(residualsOf([visit(11, 0)])).text, /not met/);
  assert.match(residualCard(null).text, /no residuals/);
});

test("the health of a log: the usual rate of each foot, gaps with their length, saturation, start", () => {
  const anomaly = (kind, from_s, to_s, samples) => ({
    session_id: "s",
    anomaly: kind,
    foot: "left",
    t_start_ns: from_s * 1e9,
    t_end_ns: to_s * 1e9,
    samples,
    detail: "",
  });
  const rates = [{ chart: "rate", series: "left", low: [100, 100, 30, null, 0, 100, 100] }];
  const health = healthOf(system, rates, [
    anomaly("gap", 2, 5.5, 350),
    anomaly("saturation", 7, 8, 12),
    anomaly("magnetic_field", 9, 9, 1),
  ]);
  assert.deepEqual(health, {
    rate_hz: { left: 100, right: null },
    gaps: 1,
    lost_s: 3.5,
    saturated: 12,
    still: true,
    other: 1,
  });
  assert.equal(healthOf(system, [], [anomaly("no_still_start", 0, 0, 0)]).still, false);
});
