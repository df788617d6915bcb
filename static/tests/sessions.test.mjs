import assert from "node:assert/strict";
import { test } from "node:test";
import { readSearch, toQuery, writeSearch } from "../js/sessions/search.js";

test("what is looked for survives its address", () => {
  const wanted = {
    text: "a&b, c",
    inspector_id: "i1",
    state: "finished",
    from: "2026-01-02",
    to: "2026-01-03",
    mode: "log",
    flags: ["gap", "starred"],
    sort: "-closure",
    page: 2,
  };
  assert.deepEqual(readSearch(writeSearch(wanted)), wanted);
  const plain = readSearch("#/sessions");
  assert.equal(writeSearch(plain), "#/sessions");
  assert.deepEqual([plain.sort, plain.page, plain.flags], ["started", 0, []]);
});

test("an address that somebody spoilt is read as far as it makes sense", () => {
  const found = readSearch("#/sessions?from=x&mode=y&flags=gap,z&sort=w&page=-3");
  assert.deepEqual([found.from, found.mode, found.flags, found.sort, found.page], ["", "", ["gap"], "started", 0]);
  assert.equal(readSearch("#/sessions?page=x").page, 0);
});

test("days are the site's, and the last one counts", () => {
  const query = toQuery({ ...readSearch("#/sessions?from=2026-01-02&to=2026-01-02&sort=-stored"), page: 1 });
  assert.equal(query.get("from"), "2026-01-02T00:00:00+08:00");
  assert.equal(Date.parse(String(query.get("to"))) - Date.parse(String(query.get("from"))), 86_400_000);
  assert.deepEqual([query.get("sort"), query.get("ascending"), query.get("offset")], ["stored", "true", "50"]);
});
