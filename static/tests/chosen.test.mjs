import assert from "node:assert/strict";
import { test } from "node:test";
import { chosenAddress, readChosen } from "../js/ui/chosen.js";

test("who is selected stands in the address, and is selected by it", () => {
  /** @type {{ui: import("../js/ui/chosen.js").Chosen}} */
  const app = { ui: { selected: "i1", fault: null, at_ms: null } };
  assert.equal(chosenAddress(app, "live"), "#/live?person=i1");
  readChosen(app, "#/faults?fault=f2");
  assert.deepEqual(app.ui, { selected: "i1", fault: "f2", at_ms: null }, "what is not named stays");
  assert.equal(chosenAddress(app, "faults"), "#/faults?person=i1&fault=f2");
  readChosen(app, "#/sessions?person=i9");
  assert.equal(app.ui.selected, "i1", "another screen's address is its own");
  assert.equal(chosenAddress(app, "sessions"), null);
  assert.equal(chosenAddress({ ui: { selected: null, fault: null, at_ms: null } }, "live"), "#/live");
  readChosen(app, "#/live?at=2026-03-04T08:00:00Z");
  assert.equal(app.ui.at_ms, Date.parse("2026-03-04T08:00:00Z"), "a moment that is past, too");
  assert.equal(chosenAddress(app, "live"), "#/live?person=i1&fault=f2&at=2026-03-04T08%3A00%3A00Z");
  readChosen(app, "#/faults");
  assert.equal(app.ui.at_ms, null, "other screens show the present");
});
