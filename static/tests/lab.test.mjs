import assert from "node:assert/strict";
import { test } from "node:test";
import { overAllWalks, verdict } from "../js/lab/comparison.js";
import { readValue } from "../js/lab/parameters.js";
import { labName, runNamed } from "../js/replay/runs.js";
import { system } from "../js/systems/pedestrian.js";

const closure = { name: "closure_m", unit: "m", aim: /** @type {const} */ ("small") };
const nis = { name: "nis_zupt", unit: "1", aim: /** @type {const} */ ("one") };

test("what is better depends on the figure, and what cannot be seen is no difference", () => {
  assert.equal(verdict(closure, 1.9, -0.5), "good");
  assert.equal(verdict(closure, 2.9, 0.5), "bad");
  assert.equal(verdict(closure, 2.4, 0.004), "");
  // From 0.8 to 1.1: nearer to 1. From 1.1 to 0.8: farther.
  assert.equal(verdict(nis, 1.1, 0.3), "good");
  assert.equal(verdict(nis, 0.8, -0.3), "bad");
  assert.equal(verdict({ ...closure, aim: "none" }, 9, 7), "");
});

test("over all walks the mean difference is told, and on how many walks it is better; runs of other input are left out", () => {
  const row = (/** @type {string} */ session_id, /** @type {number} */ difference, comparable = true) => ({
    session_id,
    title: "",
    inspector: "",
    started_at: "",
    run_id: `r-${session_id}`,
    run: "firm",
    parameters: { marker_sigma_m: 0.1 },
    aids: null,
    values: { closure_m: 2 + difference },
    differences: { closure_m: difference },
    comparable,
    provenance: null,
  });
  const own = { ...row("a", 0), run_id: null, run: "default" };
  const [all, ...others] = overAllWalks({
    figures: [closure],
    rows: [own, row("a", -1), row("b", -0.5), row("c", 0.3), row("d", -9, false)],
  });
  assert.equal(others.length, 0);
  assert.equal(all.walks, 3);
  const told = all.figures.get("closure_m");
  assert.ok(told && Math.abs(told.mean + 0.4) < 1e-12);
  assert.deepEqual([told.better, told.worse, told.walks], [2, 1, 3]);
});

test("a value is a number within the range, with a point or a comma", () => {
  const parameter = {
    key: "marker_sigma_m",
    unit: "m",
    group: "markers",
    about: "",
    least: 0.01,
    most: 20,
    default: 1,
  };
  assert.deepEqual(readValue(parameter, " 0,5 "), { value: 0.5 });
  for (const wrong of ["", "x", "0", "21", "1e99"]) assert.ok("wrong" in readValue(parameter, wrong), wrong);
});

test("a name in the address stands for the newest run that is finished", () => {
  const run = (/** @type {string} */ id, more = {}) => ({
    id,
    session_id: "s",
    name: id,
    parameters: {},
    aids: /** @type {string[] | null} */ (null),
    solution: "filtered",
    job_id: "",
    state: "finished",
    ...more,
  });
  const runs = [
    run("a", { aids: ["heading", "zupt"] }),
    run("b", { aids: ["zupt", "heading"] }),
    run("c", { aids: ["zupt", "heading"], state: "failed" }),
    run("d", { aids: ["zupt", "heading"], solution: "smoothed" }),
  ];
  assert.equal(runNamed(system, runs, "aids:zupt+heading")?.id, "b");
  assert.equal(runNamed(system, runs, labName("d"))?.id, "d");
  assert.equal(runNamed(system, runs, "aids:zupt"), undefined);
  assert.equal(runNamed(system, runs, labName("c")), undefined);
});
