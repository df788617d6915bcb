import assert from "node:assert/strict";
import { test } from "node:test";
import { Clock, gapsOf, inAll } from "../js/replay/clock.js";
import { readMoment, writeMoment } from "../js/replay/link.js";
import { extremes, ticks, timeStep, valueAt, wrapDegrees } from "../js/replay/lines.js";
import { range } from "../js/replay/plot.js";
import * as kit from "../js/replay/plots.js";
import { aidsOf, pathLength, runByAids } from "../js/replay/runs.js";
import { system } from "../js/systems/pedestrian.js";

const PLOTS = system.plots(kit);

function clock() {
  const made = new Clock();
  made.setSpan(0, 100);
  made.speed = 1;
  return made;
}

test("time runs as fast as was asked for, stops at the end and begins anew from there", () => {
  const c = clock();
  assert.equal(c.advance(5), false);
  c.toggle();
  c.advance(5);
  assert.equal(c.t_s, 5);
  for (let k = 0; k < 10; k++) c.changeSpeed(1);
  assert.equal(c.speed, 64);
  c.advance(2);
  assert.deepEqual([c.t_s, c.state], [100, "paused"]);
  c.toggle();
  assert.deepEqual([c.t_s, c.state], [0, "playing"]);
  for (let k = 0; k < 20; k++) c.changeSpeed(-1);
  assert.equal(c.speed, 0.5);
});

test("a gap takes no time when it is skipped, and its own time when it is not", () => {
  const c = clock();
  c.gaps = [
    [10, 40],
    [50, 60],
  ];
  c.seek(9);
  c.toggle();
  c.advance(3);
  assert.equal(c.t_s, 42);
  c.advance(10);
  assert.equal(c.t_s, 62);
  c.seek(20);
  c.advance(1);
  assert.equal(c.t_s, 41);
  c.skipGaps = false;
  c.seek(9);
  c.advance(3);
  assert.equal(c.t_s, 12);
});

test("a stretch is played over and over", () => {
  const c = clock();
  c.setLoop(30, 20);
  assert.deepEqual(c.loop, [20, 30]);
  c.seek(29);
  c.toggle();
  c.advance(3);
  assert.equal(c.t_s, 22);
  c.setLoop(5, 5);
  assert.equal(c.loop, null);
});

test("live, paused and playing do not fight: a look back leaves the newest moment, Space never jumps", () => {
  const c = clock();
  c.goLive();
  assert.equal(c.t_s, 100);
  c.setSpan(0, 130);
  assert.equal(c.t_s, 130);
  c.toggle();
  assert.deepEqual([c.t_s, c.state], [130, "paused"]);
  c.setSpan(0, 150);
  assert.equal(c.t_s, 130);
  c.goLive();
  c.seek(60);
  assert.equal(c.state, "paused");
});

test("gaps are where a track has no points; together they are where nobody has any", () => {
  assert.deepEqual(gapsOf([0, 1, 2, 9, 10], 2.5), [[2, 9]]);
  assert.deepEqual(
    inAll([
      [
        [2, 9],
        [20, 30],
      ],
      [[5, 25]],
    ]),
    [
      [5, 9],
      [20, 25],
    ],
  );
});

test("a value at the cursor is that of its step, or the last one before that is not long gone", () => {
  const line = {
    chart: "a",
    series: "b",
    start_s: 10,
    step_s: 2,
    low: [1, null, null, null, 5],
    high: [3, null, null, null, 7],
  };
  assert.equal(valueAt(line, 11), 2);
  assert.equal(valueAt(line, 13), 2);
  assert.equal(valueAt(line, 17), null);
  assert.equal(valueAt(line, 19), 6);
  assert.equal(valueAt(line, 9), null);
  assert.deepEqual(extremes(line, 10, 12), [1, 3]);
  assert.equal(extremes(line, 12, 16), null);
});

test("axes carry round numbers", () => {
  assert.deepEqual(ticks(0, 10), [0, 5, 10]);
  assert.deepEqual(ticks(-0.3, 0.31), [-0.2, 0, 0.2]);
  assert.equal(timeStep(2700, 10), 300);
  assert.equal(wrapDegrees(-190), 170);
  assert.equal(wrapDegrees(540), 180);
});

test("a moment's address is read as it was written", () => {
  const moment = { t_s: 61.25, runs: ["main", runByAids(system, ["heading", "zupt"])], beside: ["s7", "s8"] };
  const hash = writeMoment("s9", moment);
  assert.equal(hash, "#/sessions/s9?t=61.25&run=main,aids:zupt+heading&with=s7,s8");
  assert.deepEqual(readMoment(hash), moment);
  assert.deepEqual(readMoment("#/sessions/s9"), { t_s: null, runs: null, beside: [] });
  assert.deepEqual(readMoment("#/sessions/s9?t=x"), { t_s: null, runs: null, beside: [] });
});

test("a run by chosen aids names them; others have none", () => {
  assert.deepEqual(aidsOf(system, "aids:zupt+heading"), ["zupt", "heading"]);
  assert.equal(aidsOf(system, "main"), null);
  assert.equal(aidsOf(system, "aids:magic"), null);
});

test("a path is as long as its metres; standing adds nothing", () => {
  const e_m = [0, 3, 3.2, 2.9, 3.1, 6];
  assert.equal(pathLength({ e_m, n_m: e_m.map(() => 0) }), 6);
});

test("every chart that is drawn is asked for, with what its bands need", () => {
  const wanted = kit.chartsOf(PLOTS, system.readouts);
  for (const plot of PLOTS)
    for (const line of plot.lines)
      assert.ok(wanted.includes(line.chart) && (!line.sigma || wanted.includes(line.sigma)), line.chart);
  for (const { strips } of PLOTS)
    for (const strip of strips ?? []) assert.ok(wanted.includes(strip.chart), strip.chart);
  // The read-out needs some whatever is drawn.
  assert.deepEqual(kit.chartsOf([], system.readouts), ["stance", "speed"]);
});

test("a heading is drawn by the whole circle, or close to where it changes little", () => {
  const plot = PLOTS.find((p) => p.id === "heading");
  const picture = (low) => ({
    plot,
    line: (chart, series) => (series === "main" ? { chart, series, start_s: 0, step_s: 1, low } : undefined),
    limits: [],
    dots: [],
    from_s: 0,
    to_s: low.length,
  });
  assert.deepEqual(range(picture([0, 1, 2, 3, 4])), [0, 360]);
  // Two full turns and 10°, and a degree more.
  const [least, most] = range(picture([4 * Math.PI + 10 * (Math.PI / 180), 4 * Math.PI + 11 * (Math.PI / 180)]));
  assert.ok(least > 8 && least < 10 && most > 11 && most < 13, `${least} ${most}`);
});

test("a single large innovation does not flatten the others; a field is shown with its gate", () => {
  const of = (id, low, limits) =>
    range({
      plot: PLOTS.find((p) => p.id === id),
      line: (chart, series) => ({ chart, series, start_s: 0, step_s: 1, low }),
      limits: limits.map((value) => ({ chart: id, name: "x", value })),
      dots: [],
      from_s: 0,
      to_s: low.length,
    });
  assert.ok(of("nis_heading", [0.5, 900], [3.84, 10.83])[1] < 16);
  const [least, most] = of("field", [47, 49], [40, 60]);
  assert.ok(least < 40 && most > 60);
});
