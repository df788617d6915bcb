import assert from "node:assert/strict";
import { test } from "node:test";
import { readPaper } from "../js/sessions/paper.js";

const named = (/** @type {string} */ name) => (name.toUpperCase() === "A17" ? "A17" : undefined);
/** 9 in the morning at the site. */
const STARTED = "2026-07-01T01:00:00Z";

test("a line has a time of day at the site and a marker; without seconds it is anywhere in its minute", () => {
  const { visits, wrong } = readPaper("09:10 a17\n\n 9:20:30, A17\n08：59；A17", STARTED, named);
  assert.deepEqual(wrong, []);
  assert.deepEqual(visits, [
    { marker: "A17", t_start_s: 600, t_end_s: 659 },
    { marker: "A17", t_start_s: 1226, t_end_s: 1230 },
    { marker: "A17", t_start_s: -60, t_end_s: -1 },
  ]);
});

test("a walk goes over midnight", () => {
  const { visits } = readPaper("00:10:00 A17", "2026-07-01T15:50:00Z", named);
  assert.equal(visits[0].t_end_s, 1200);
});

test("what is no time or no marker is told with its line", () => {
  const { visits, wrong } = readPaper("09:10 A17\n25:00 A17\n09:10 Z9\nA17", STARTED, named);
  assert.equal(visits.length, 1);
  assert.deepEqual(
    wrong.map(({ line }) => line),
    [2, 3, 4],
  );
});
