import assert from "node:assert/strict";
import { test } from "node:test";
import { dayBegins, siteDay } from "../js/format.js";
import { CLOSE_PX, crowds, fan } from "../js/map/crowds.js";
import { people } from "../js/state/attention.js";
import { emptyState } from "../js/state/live.js";
import { hoursBetweenLabels, nearestTo, pastState, underWay } from "../js/state/past.js";

const AT = Date.parse("2026-03-04T08:00:00Z");
const iso = (/** @type {number} */ ms) => new Date(ms).toISOString();
/** @param {string} id @param {number} age_s @param {number} speed_m_s */
const walk = (id, age_s, speed_m_s) => ({
  session: { id: `s-${id}`, inspector_id: id, state: "finished", started_at: iso(AT - 60_000) },
  position: {
    t_ns: 60e9,
    age_s,
    position_m: /** @type {[number, number, number]} */ ([10 * Number(id), 0, 0]),
    heading_rad: 0,
    sigma_heading_rad: 0.1,
    sigma_m: /** @type {[number, number, number]} */ ([1, 1, 1]),
    covariance_en_m2: 0,
  },
  trail: /** @type {[number, number, number][]} */ ([50, 55, 60].map((s) => [s * 1e9, s * speed_m_s, 0])),
});
const live = emptyState();
live.inspectors = new Map([1, 2, 3].map((i) => [String(i), { id: String(i), name: `P${i}` }]));

test("a moment that is past is shown as the present is: who walked, who stood, who was silent", () => {
  const moment = { at: iso(AT), walks: [walk("1", 0.1, 1.2), walk("2", 0.1, 0), walk("3", 90, 1)] };
  const state = pastState(moment, live, []);
  const presences = Object.fromEntries(people(state, AT).map((p) => [p.inspector.name, p.presence]));
  assert.deepEqual(presences, { P1: "walking", P2: "standing", P3: "lost" });
  const nearest = nearestTo(state, [19, 0], 2);
  assert.deepEqual(nearest, [
    { name: "P2", distance_m: 1 },
    { name: "P1", distance_m: 9 },
  ]);
});

test("of faults those stand that were reported by then and not closed yet", () => {
  const fault = (/** @type {string} */ id, /** @type {number} */ from, /** @type {number | null} */ to) =>
    /** @type {any} */ ({
      id,
      reported_at: iso(AT + from),
      closed_at: to === null ? null : iso(AT + to),
      state: "verified",
    });
  const faults = [fault("later", 1, null), fault("closed", -9, -1), fault("stood", -9, 5), fault("stands", -9, null)];
  const state = pastState({ at: iso(AT), walks: [] }, live, faults);
  assert.deepEqual([...state.faults.keys()], ["stood", "stands"]);
});

test("a day of the site begins at its own midnight, and its walks are counted by stretches", () => {
  const begins = dayBegins("2026-03-04");
  assert.equal(iso(begins), "2026-03-03T16:00:00.000Z");
  assert.equal(siteDay(begins), "2026-03-04");
  assert.equal(siteDay(begins - 1), "2026-03-03");
  const hour = 3_600_000;
  const sessions = [
    { started_at: iso(begins - hour), ended_at: iso(begins + hour / 2) },
    { started_at: iso(begins + 2 * hour), ended_at: null, duration_s: 3600 },
    { started_at: null },
  ];
  assert.deepEqual(underWay(sessions, begins, 5, hour), [1, 0, 1, 1, 0]);
});

test("who would hide another is in one group, whoever comes first stands for it, and nobody is in two", () => {
  // Across the border of two squares as well.
  const places = [0, CLOSE_PX - 1, CLOSE_PX + 2, 5 * CLOSE_PX, 5 * CLOSE_PX + 1, 40 * CLOSE_PX];
  const groups = crowds(places, (x) => [x, 0]);
  assert.deepEqual(groups, [[places[0], places[1]], [places[2]], [places[3], places[4]], [places[5]]]);
});

test("in a fan no sign hides another, however many there are", () => {
  for (const n of [2, 3, 7, 46]) {
    const places = fan(n);
    assert.equal(places.length, n);
    places.forEach(([x, y], i) => {
      for (const [other, below] of places.slice(0, i))
        assert.ok(Math.hypot(x - other, y - below) > 2 * CLOSE_PX, `${n}`);
    });
  }
});

test("the strip of a day names as many hours as it has room for", () => {
  assert.equal(hoursBetweenLabels(1200), 1);
  assert.equal(hoursBetweenLabels(700), 2);
  assert.equal(hoursBetweenLabels(360), 3);
  assert.equal(hoursBetweenLabels(320), 6);
  assert.equal(hoursBetweenLabels(100), 12);
});
