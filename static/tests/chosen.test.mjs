import assert from "node:assert/strict";
import { test } from "node:test";
import { chosenAddress, readChosen } from "../js/ui/chosen.js";

test("who is selected stands in the address, and is selected by it", () => {
  const app = { ui: { selected: /** @type {string | null} */ ("i1"), fault: /** @type {string | null} */ (null) } };
  assert.equal(chosenAddress(app, "live"), "#/live?person=i1");
  readChosen(app, "#/faults?fault=f2");
  assert.deepEqual(app.ui, { selected: "i1", fault: "f2" }, "what is not named stays");
  assert.equal(chosenAddress(app, "faults"), "#/faults?person=i1&fault=f2");
  readChosen(app, "#/sessions?person=i9");
  assert.equal(app.ui.selected, "i1", "another screen's address is its own");
  assert.equal(chosenAddress(app, "sessions"), null);
  assert.equal(chosenAddress({ ui: { selected: null, fault: null } }, "live"), "#/live");
});
