import assert from "node:assert/strict";
import { test } from "node:test";
import { newId, Outbox } from "../js/me/outbox.js";
import {
  changePerson,
  chips,
  doubt,
  firstLetters,
  press,
  recallMine,
  rememberMine,
  visitTimes,
} from "../js/me/walk.js";

function memory() {
  const kept = new Map();
  return {
    kept,
    recall: (key) => kept.get(key) ?? null,
    remember: (key, value) => void (value === null ? kept.delete(key) : kept.set(key, value)),
  };
}

class Refused extends Error {
  constructor(status) {
    super(`refused ${status}`);
    this.status = status;
  }
}

/** A server that keeps what it is told under its id, and may lose its answers or be away. */
function server() {
  const held = new Map();
  const state = { away: false, loseAnswers: 0, calls: 0, held, refuse: new Set() };
  const take = (id, what) => {
    state.calls += 1;
    if (state.away) throw new Error("no link");
    if (state.refuse.has(id)) throw new Refused(422);
    if (!held.has(id)) held.set(id, what);
    if (state.loseAnswers > 0) {
      state.loseAnswers -= 1;
      throw new Error("the answer was lost");
    }
    return held.get(id);
  };
  const api = {
    createSession: async ({ id, ...body }) => take(id, body),
    addVisit: async (session_id, visit) => take(`${session_id} ${visit.marker} ${visit.t_start_s}`, visit),
    takeVisitBack: async (_session, id) => {
      if (id === "gone") throw new Refused(404);
      return take(`back ${id}`, null);
    },
    reportFault: async ({ id, ...body }) => take(id, body),
  };
  return { ...state, api, state };
}

const fault = (id) => /** @type {any} */ ({ id, kind: "fault", at_ms: 0, body: { kind: "drainage" } });

test("what is said without a link is kept over a reload and handed over once, in order", async () => {
  const storage = memory();
  const { api, state } = server();
  state.away = true;
  const before = new Outbox(api, storage);
  await before.add({ id: "w1", kind: "walk", at_ms: 0, body: { inspector_id: "i1" } });
  await before.add({
    id: "x",
    kind: "visit",
    at_ms: 1,
    body: { session_id: "w1", marker: "A17", t_start_s: 4, t_end_s: 8 },
  });
  await before.add(fault("f1"));
  assert.equal(before.entries().length, 3);

  const sent = [];
  const after = new Outbox(api, storage, { onSent: (entry) => sent.push(entry.id) });
  state.away = false;
  // The answer to the first is lost on the way: it is sent again and makes nothing new.
  state.loseAnswers = 1;
  await after.flush();
  assert.equal(after.entries().length, 3);
  await after.flush();
  assert.deepEqual(sent, ["w1", "x", "f1"]);
  assert.deepEqual([...state.held.keys()], ["w1", "w1 A17 4", "f1"]);
  assert.deepEqual([after.entries().length, storage.recall("outbox")], [0, null]);
});

test("what the server refuses is shown and does not hold up the rest", async () => {
  const { api, state } = server();
  state.refuse.add("bad");
  const outbox = new Outbox(api, memory());
  await outbox.add(fault("bad"));
  await outbox.add(fault("good"));
  assert.deepEqual(
    outbox.entries().map((entry) => [entry.id, entry.refused]),
    [["bad", "refused 422"]],
  );
  assert.ok(outbox.drop("bad"));
  assert.ok(!outbox.drop("bad"));
});

test("who is not signed in keeps it; what one may not is refused", async () => {
  for (const [status, left] of /** @type {const} */ ([
    [401, undefined],
    [403, "refused 403"],
  ])) {
    /** @type {any} */
    const api = {
      reportFault: async () => {
        throw new Refused(status);
      },
    };
    const outbox = new Outbox(api, memory());
    await outbox.add(fault("f"));
    assert.deepEqual(
      outbox.entries().map((entry) => entry.refused),
      [left],
    );
  }
});

test("two calls at once send nothing twice; taking back what is gone is success", async () => {
  const { api, state } = server();
  const outbox = new Outbox(api, memory());
  outbox.keep([
    fault("a"),
    fault("b"),
    { id: "c", kind: "take_back", at_ms: 0, body: { session_id: "s", visit_id: "gone" } },
  ]);
  await Promise.all([outbox.flush(), outbox.flush(), outbox.flush()]);
  assert.equal(state.calls, 2);
  assert.equal(outbox.entries().length, 0);
});

test("damaged storage is empty storage", () => {
  const storage = memory();
  storage.remember("outbox", "{");
  storage.remember("me", "[1]");
  assert.deepEqual(new Outbox(server().api, storage).entries(), []);
  assert.equal(recallMine(storage).inspector_id, "");
  rememberMine(storage, { inspector_id: "i1", walk: null, ended: null, keyed: [], others: {} });
  assert.equal(recallMine(storage).inspector_id, "i1");
});

test("several share a kiosk: whoever walks is found again as they were", () => {
  const walk = { id: "w1", started_ms: 5, live: false };
  const storage = memory();
  rememberMine(storage, { inspector_id: "i1", walk, ended: null, keyed: [], others: {} });
  const mine = recallMine(storage);
  changePerson(mine, "i2");
  assert.deepEqual([mine.inspector_id, mine.walk], ["i2", null]);
  rememberMine(storage, mine);
  const again = recallMine(storage);
  changePerson(again, "i1");
  assert.deepEqual([again.inspector_id, again.walk], ["i1", walk]);
  assert.deepEqual(again.others, {}, "who does not walk leaves nothing");
});

test("a visit is the stand that lasts, or the last seconds", () => {
  assert.deepEqual(visitTimes(1000, 61_000, []), { t_start_s: 56, t_end_s: 60 });
  assert.deepEqual(visitTimes(1000, 2000, []), { t_start_s: 0, t_end_s: 1 });
  assert.deepEqual(
    visitTimes(0, 60_000, [
      { lasts: false, t_start_ns: 1e9 },
      { lasts: true, t_start_ns: 41.25e9 },
    ]),
    { t_start_s: 41.25, t_end_s: 60 },
  );
});

test("a place is doubted far from the track, or sooner than anybody walks there", () => {
  const place = (name, e_m) => ({ name, e_m, n_m: 0 });
  const position = { position_m: [0, 0, 0], sigma_m: [1, 1, 1] };
  assert.equal(doubt(place("A1", 14), { position, last: null }), null);
  assert.deepEqual(doubt(place("A1", 40), { position, last: null }), { key: "position", metres: 40 });
  assert.equal(doubt(place("A1", 40), { position: { ...position, sigma_m: [10, 10, 1] }, last: null }), null);
  const last = { place: place("A1", 0), ago_s: 20 };
  assert.equal(doubt(place("A2", 80), { position: null, last }), null);
  assert.equal(doubt(place("A2", 200), { position: null, last })?.key, "hurry");
  assert.equal(doubt(place("A2", 200), { position: null, last: null }), null);
});

test("the stand's candidates are offered before the nearest", () => {
  const nearest = (e, n, k) =>
    Array.from({ length: k }, (_, i) => ({ place: { name: `B${i}`, e_m: e, n_m: n }, distance_m: i }));
  const stand = {
    candidates: [
      { marker: "A17", probability: 0.7, distance_m: 2 },
      { marker: null, probability: 0.3, distance_m: null },
    ],
  };
  assert.deepEqual(chips(stand, [0, 0], nearest), [{ marker: "A17", distance_m: 2, probability: 0.7 }]);
  assert.equal(chips(undefined, [0, 0], nearest).length, 6);
  assert.deepEqual(chips(undefined, null, nearest), []);
});

test("the pad", () => {
  assert.deepEqual(firstLetters(["A0", "B12", "A3", "7"]), ["A", "B"]);
  assert.equal(["1", "B", "2", "A"].reduce(press, ""), "A12");
  assert.equal(press("A12", "back"), "A1");
  assert.equal(press("A12", "clear"), "");
});

test("an id is a UUID", () => {
  assert.match(newId(), /^[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$/);
  assert.notEqual(newId(), newId());
});
