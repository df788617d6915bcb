import assert from "node:assert/strict";
import { test } from "node:test";
import { passes, stands, STATES, stepsFrom } from "../js/faults/states.js";

const ALL = { state: "", severity: "", assignee: "", text: "" };
/** @type {any} */
const fault = { id: "f", state: "in_work", severity: "high", assignee_id: "i1" };

test("every state offers a step that goes on, and only what is fixed can be verified", () => {
  for (const state of STATES) {
    assert.ok(stepsFrom(state).length > 0, state);
    assert.equal(stepsFrom(state).includes("verified"), state === "fixed", state);
  }
  assert.deepEqual(stepsFrom("a state of a newer server"), []);
  assert.ok(stands({ state: "fixed" }) && !stands({ state: "verified" }));
});

test("a filter narrows by state, severity, person and words", () => {
  const shown = (/** @type {Partial<typeof ALL>} */ filter, of = fault) =>
    passes(of, { ...ALL, ...filter }, "Anchor bolt A17 王芳");
  assert.ok(shown({}) && shown({ state: "standing" }) && shown({ state: "in_work" }));
  assert.ok(!shown({ state: "open" }) && !shown({ state: "standing" }, { ...fault, state: "verified" }));
  assert.ok(shown({ severity: "high" }) && !shown({ severity: "low" }));
  assert.ok(shown({ assignee: "i1" }) && !shown({ assignee: "i2" }) && !shown({ assignee: "nobody" }));
  assert.ok(shown({ assignee: "nobody" }, { ...fault, assignee_id: null }));
  const nowhere = { ...fault, position_m: null, marker: null };
  assert.ok(
    shown({ state: "to_be_placed" }, nowhere) && !shown({ state: "to_be_placed" }, { ...nowhere, marker: "A1" }),
  );
  assert.ok(!shown({ state: "to_be_placed" }, { ...nowhere, state: "verified" }));
  assert.ok(shown({ text: " a17" }) && shown({ text: "王" }) && !shown({ text: "b17" }));
});
