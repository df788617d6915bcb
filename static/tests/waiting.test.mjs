import assert from "node:assert/strict";
import { test } from "node:test";
import { alreadyHere, chosen, knownWalks, logQuery, waitingList } from "../js/upload/waiting.js";

/** @type {any} */
const walk = {
  id: "w1",
  inspector: "<Li>",
  title: "",
  system: "pedestrian",
  started_at: "2026-07-01T01:00:00Z",
  keyed: 4,
  faults: 1,
  fits: false,
  start: { marker: "A17" },
};

test("a walk that waits is listed with whose it is, and stays when its upload is given up", () => {
  const text = waitingList([walk]).text;
  assert.match(text, /data-waiting="w1"/);
  assert.match(text, /&lt;Li&gt;/);
  assert.match(text, /upload\.too_short/);
  assert.equal(waitingList([]).text, "");
  assert.deepEqual([chosen(walk).session_id, chosen(walk).waits, chosen(walk).logs], ["w1", true, {}]);
});

test("what a log says of itself finds its walk: its length, and its day where its clock has one", () => {
  const preview = (/** @type {[number, number]} */ clock_ns) => /** @type {any} */ ({ clock_ns });
  const own = logQuery([preview([0, 60e9]), preview([1e9, 90e9])]);
  assert.deepEqual([own.get("duration_s"), own.get("began_at")], ["90", null]);
  const of_day = logQuery([preview([1_782_867_600e9, 1_782_867_660e9])]);
  assert.equal(of_day.get("began_at"), "2026-07-01T01:00:00.000Z");
  assert.equal(String(logQuery([])), "");
});

test("a log that another walk holds is offered to be opened; that of its own walk is sent again", async () => {
  const file = new File(["abc"], "left.csv");
  const session = { id: "w1", title: "", started_at: "2026-07-01T01:00:00Z" };
  const asked = /** @type {string[]} */ ([]);
  const api = {
    async knownLogs(/** @type {string} */ sha256) {
      asked.push(sha256);
      return [{ session, inspector: "Li", stream: "left" }];
    },
  };
  const known = await knownWalks(api, [file, file], undefined);
  assert.equal(asked[0], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  assert.equal(known.length, 1);
  assert.match(alreadyHere(known).text, /#\/sessions\/w1/);
  assert.deepEqual(await knownWalks(api, [file], "w1"), []);
});
