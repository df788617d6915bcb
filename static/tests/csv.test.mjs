import assert from "node:assert/strict";
import { test } from "node:test";
import { csv } from "../js/ui/csv.js";

test("a list is a table that no spreadsheet takes for formulas", () => {
  const rows = [
    { name: '=1+1 "x"', metres: -2.5, there: true },
    { name: "李娜, 王芳", metres: null },
  ];
  assert.equal(csv(["name", "metres", "there"], rows), `name,metres,there\n"'=1+1 ""x""",-2.5,true\n"李娜, 王芳",,\n`);
});
