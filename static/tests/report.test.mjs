import assert from "node:assert/strict";
import { test } from "node:test";
import { verdict } from "../js/sessions/report.js";

test("an aid is judged by the bounds of its mean innovation", () => {
  /** @param {number} mean */
  const aid = (mean) => ({
    aid: "zupt",
    accepted: 100,
    rejected: 0,
    unusable: 0,
    mean_nis_per_degree: mean,
    bounds_95: /** @type {[number, number]} */ ([0.8, 1.2]),
  });
  assert.equal(verdict(aid(1)), "honest");
  assert.equal(verdict(aid(0.79)), "too_unsure");
  assert.equal(verdict(aid(1.21)), "too_sure");
  assert.equal(verdict({ ...aid(1), bounds_95: null }), "unknown");
  assert.equal(verdict({ ...aid(0), accepted: 0 }), "unknown");
});
