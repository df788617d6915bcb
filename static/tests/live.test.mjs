import assert from "node:assert/strict";
import { test } from "node:test";
import { people, presenceOf, SILENT_AFTER_S } from "../js/state/attention.js";
import { standChoices, visitOfStand } from "../js/state/findings.js";
import { apply, emptyState, GONE_AFTER_S, LOST_AFTER_S } from "../js/state/live.js";
import { extend, revise } from "../js/state/trail.js";

const NOW = Date.parse("2026-07-01T08:00:00Z");
const position = (over = {}) => ({
  kind: "position",
  session_id: "s1",
  inspector_id: "i1",
  t_ns: 10e9,
  position_m: [1, 2, 3],
  heading_rad: 0,
  sigma_m: [1, 1, 1],
  covariance_en_m2: 0,
  speed_m_s: 1,
  state: "walking",
  since_marker_s: 1,
  since_marker_m: 1,
  distance_m: 1,
  received_at: new Date(NOW).toISOString(),
  ...over,
});
const snapshot = (over = {}) => ({
  type: "snapshot",
  boot: "b",
  seq: 10,
  server_time: new Date(NOW).toISOString(),
  inspectors: [
    { id: "i1", name: "Li" },
    { id: "i2", name: "An" },
  ],
  sessions: [
    {
      id: "s1",
      inspector_id: "i1",
      state: "live",
      started_at: "2026-07-01T07:00:00Z",
      trail: [
        [1e9, 0, 0],
        [2e9, 1, 0],
        [3e9, 2, 0],
      ],
      position: null,
    },
  ],
  faults: [],
  markers_revision: 1,
  ...over,
});
const changes = (seq, ...list) => ({ type: "changes", seq, server_time: new Date(NOW).toISOString(), changes: list });
const started = () => {
  const state = emptyState();
  apply(state, snapshot(), NOW);
  return state;
};

test("a position moves the inspector and grows the trail", () => {
  const state = started();
  const { gap, changed } = apply(state, changes(11, position()), NOW);
  assert.equal(gap, false);
  assert.ok(changed.has("position"));
  assert.deepEqual(state.sessions.get("s1")?.trail.at(-1), [10e9, 1, 2]);
  assert.equal(state.seq, 11);
});

test("a message that was seen already changes nothing", () => {
  const state = started();
  apply(state, changes(11, position()), NOW);
  apply(state, changes(11, position({ position_m: [9, 9, 9] })), NOW);
  assert.deepEqual(state.sessions.get("s1")?.position?.position_m, [1, 2, 3]);
});

test("a hole in the sequence is noticed and nothing after it is applied", () => {
  const state = started();
  const { gap } = apply(state, changes(13, position()), NOW);
  assert.equal(gap, true);
  assert.equal(state.seq, 10);
  assert.equal(state.sessions.get("s1")?.position, null);
});

test("a heartbeat ahead of what was seen is a hole, too", () => {
  const state = started();
  assert.equal(apply(state, { type: "heartbeat", seq: 10, server_time: new Date(NOW).toISOString() }, NOW).gap, false);
  assert.equal(apply(state, { type: "heartbeat", seq: 12, server_time: new Date(NOW).toISOString() }, NOW).gap, true);
});

test("a new snapshot replaces everything", () => {
  const state = started();
  apply(state, snapshot({ seq: 50, sessions: [], boot: "b2" }), NOW);
  assert.equal(state.sessions.size, 0);
  assert.equal(state.boot, "b2");
  assert.equal(apply(state, changes(51), NOW).gap, false);
});

test("a session that goes on keeps its trail and its position when its row changes", () => {
  const state = started();
  apply(state, changes(11, position()), NOW);
  apply(
    state,
    changes(12, {
      kind: "session",
      session: { id: "s1", inspector_id: "i1", state: "finished", visits: 3, anomalies: 0 },
    }),
    NOW,
  );
  const session = state.sessions.get("s1");
  assert.equal(session?.state, "finished");
  assert.equal(session?.trail.length, 4);
  assert.deepEqual(session?.visits, []);
});

test("a visit that has been weighed takes the place of the one that was keyed in", () => {
  const state = started();
  const visit = { kind: "visit", id: "v", session_id: "s1", marker: "A17", t_start_ns: 1e9, t_end_ns: 5e9 };
  apply(state, changes(11, visit), NOW);
  apply(state, changes(12, { ...visit, accepted: true, nis: 2 }), NOW);
  assert.deepEqual(
    state.sessions.get("s1")?.visits.map((v) => v.accepted),
    [true],
  );
});

test("stands come one by one or all at once, and a visit that is taken back is gone", () => {
  const state = started();
  const stand = (number, probability) => ({
    number,
    t_start_ns: number * 100e9,
    t_end_ns: number * 100e9 + 9e9,
    lasts: false,
    position_m: [0, 0, 0],
    candidates: [
      { marker: "A17", probability, distance_m: 1 },
      { marker: null, probability: 1 - probability, distance_m: null },
    ],
  });
  const stands = () => state.sessions.get("s1")?.stands.map((s) => [s.number, s.candidates[0].probability]);
  apply(
    state,
    changes(
      11,
      { kind: "stands", session_id: "s1", all: false, stands: [stand(2, 0.6)] },
      { kind: "stands", session_id: "s1", all: false, stands: [stand(1, 0.5)] },
    ),
    NOW,
  );
  apply(state, changes(12, { kind: "stands", session_id: "s1", all: false, stands: [stand(2, 0.9)] }), NOW);
  assert.deepEqual(stands(), [
    [1, 0.5],
    [2, 0.9],
  ]);
  apply(
    state,
    changes(13, {
      kind: "visit",
      id: "v",
      session_id: "s1",
      marker: "A17",
      t_start_ns: 200e9,
      t_end_ns: 204e9,
      origin: "automatic",
    }),
    NOW,
  );
  const session = state.sessions.get("s1");
  assert.equal(session && visitOfStand(session.stands[1], session.visits)?.id, "v");
  assert.equal(session && visitOfStand(session.stands[0], session.visits), null);
  const { changed } = apply(
    state,
    changes(
      14,
      { kind: "visit_removed", session_id: "s1", id: "v" },
      { kind: "stands", session_id: "s1", all: true, stands: [stand(1, 0.7)] },
    ),
    NOW,
  );
  assert.deepEqual(session?.visits, []);
  assert.deepEqual(stands(), [[1, 0.7]]);
  assert.ok(changed.has("stand") && changed.has("visit"));
});

test("of a stand the likeliest are shown, and none of these is all the rest", () => {
  const candidates = [0.4, 0.2, 0.15, 0.1, 0.05].map((probability, i) => ({
    marker: `A${i}`,
    probability,
    distance_m: 1,
  }));
  const { named, none } = standChoices({
    number: 1,
    t_start_ns: 0,
    t_end_ns: 1,
    lasts: true,
    position_m: [0, 0, 0],
    candidates: [...candidates, { marker: null, probability: 0.1, distance_m: null }],
  });
  assert.deepEqual(
    named.map((c) => c.marker),
    ["A0", "A1", "A2", "A3"],
  );
  assert.ok(Math.abs(none - 0.15) < 1e-9);
});

test("a changed table of inspectors replaces the old one", () => {
  const state = started();
  apply(state, changes(11, { kind: "inspectors", inspectors: [{ id: "i9", name: "Wu" }] }), NOW);
  assert.deepEqual([...state.inspectors.keys()], ["i9"]);
});

test("a deleted session is gone", () => {
  const state = started();
  apply(state, changes(11, { kind: "session", deleted: "s1" }), NOW);
  assert.equal(state.sessions.size, 0);
});

test("a revision replaces the trail from its first to its last time, with more or fewer points", () => {
  const state = started();
  apply(
    state,
    changes(11, {
      kind: "revision",
      session_id: "s1",
      points: [
        [2e9, 5, 5],
        [2.5e9, 6, 6],
        [3e9, 7, 7],
      ],
    }),
    NOW,
  );
  assert.deepEqual(state.sessions.get("s1")?.trail, [
    [1e9, 0, 0],
    [2e9, 5, 5],
    [2.5e9, 6, 6],
    [3e9, 7, 7],
  ]);
  apply(
    state,
    changes(12, {
      kind: "revision",
      session_id: "s1",
      points: [
        [1e9, 1, 1],
        [3e9, 2, 2],
      ],
    }),
    NOW,
  );
  assert.deepEqual(state.sessions.get("s1")?.trail, [
    [1e9, 1, 1],
    [3e9, 2, 2],
  ]);
});

test("a revision that leaves a hole in the middle keeps both sides in order", () => {
  const trail = [
    [1, 0, 0],
    [2, 0, 0],
    [3, 0, 0],
    [9, 0, 0],
  ];
  revise(/** @type {any} */ (trail), [[2, 8, 8]]);
  assert.deepEqual(
    trail.map((p) => p[0]),
    [1, 2, 3, 9],
  );
  assert.equal(trail[1][1], 8);
  revise(/** @type {any} */ (trail), []);
  assert.equal(trail.length, 4);
});

test("a late point finds its place, a repeated time replaces", () => {
  /** @type {any[]} */
  const trail = [
    [1, 0, 0],
    [5, 0, 0],
  ];
  extend(trail, [3, 1, 1]);
  extend(trail, [5, 2, 2]);
  assert.deepEqual(trail, [
    [1, 0, 0],
    [3, 1, 1],
    [5, 2, 2],
  ]);
});

test("a revision says how far back the drawn past has to be drawn again", () => {
  const state = started();
  const session = state.sessions.get("s1");
  apply(
    state,
    changes(
      11,
      { kind: "revision", session_id: "s1", points: [[2e9, 5, 5]] },
      { kind: "revision", session_id: "s1", points: [[3e9, 5, 5]] },
    ),
    NOW,
  );
  assert.equal(session?.revised_from_ns, 2e9);
});

test("people go stale without any message: walking, silent, lost", () => {
  const state = started();
  apply(state, changes(11, position()), NOW);
  const presence = (seconds) => people(state, NOW + seconds * 1000).find((p) => p.inspector.id === "i1")?.presence;
  assert.equal(presence(SILENT_AFTER_S - 1), "walking");
  assert.equal(presence(SILENT_AFTER_S + 1), "silent");
  assert.equal(presence(LOST_AFTER_S + 1), "lost");
  assert.equal(presence(GONE_AFTER_S + 1), "gone");
  const sigma = (/** @type {number} */ seconds) =>
    people(state, NOW + seconds * 1000).find((p) => p.inspector.id === "i1")?.sigma_m ?? 0;
  assert.ok(sigma(SILENT_AFTER_S + 10) > sigma(0) + 10, "nobody knows where a silent one has gone meanwhile");
});

test("age is by the server's clock, even when this machine's is an hour off", () => {
  const state = emptyState();
  apply(state, snapshot(), NOW + 3_600_000);
  apply(state, changes(11, position()), NOW + 3_600_000);
  assert.equal(people(state, NOW + 3_600_000 + 2000).find((p) => p.inspector.id === "i1")?.presence, "walking");
});

test("the silent and the unsure come before those who are well, those who are not out come last", () => {
  const state = emptyState();
  const sessions = ["a", "b", "c"].map((id) => ({
    id: `s-${id}`,
    inspector_id: id,
    state: "live",
    started_at: "2026-07-01T07:00:00Z",
    trail: [],
    position: position({ session_id: `s-${id}`, inspector_id: id }),
  }));
  sessions[1].position.sigma_m = [9, 2, 1];
  sessions[2].position.received_at = new Date(NOW - 20_000).toISOString();
  apply(state, snapshot({ inspectors: ["a", "b", "c", "0"].map((id) => ({ id, name: id })), sessions }), NOW);
  assert.deepEqual(
    people(state, NOW).map((p) => p.inspector.id),
    ["c", "b", "a", "0"],
  );
});

test("a session that has ended shows nobody out", () => {
  assert.equal(presenceOf(/** @type {any} */ ({ state: "finished", position: position() }), NOW).presence, "off");
});

test("faults open and close by their id", () => {
  const state = started();
  apply(state, changes(11, { kind: "fault", fault: { id: "f", state: "open" } }), NOW);
  apply(state, changes(12, { kind: "fault", fault: { id: "f", state: "closed" } }), NOW);
  assert.equal(state.faults.get("f")?.state, "closed");
});
