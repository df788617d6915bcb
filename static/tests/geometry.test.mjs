import assert from "node:assert/strict";
import { test } from "node:test";
import { ellipse, headingDegrees, K95, rankPlaces, worstSigma } from "../js/geometry.js";
import { SpatialIndex } from "../js/spatial_index.js";
import { makePlan } from "./mock/plan.mjs";

test("the 95 % ellipse of a round sigma of 2 m has a radius of 4.895 m", () => {
  const { major_m, minor_m } = ellipse(4, 4, 0);
  assert.ok(Math.abs(K95 - 2.4477468) < 1e-6);
  assert.ok(Math.abs(major_m - 4.8954937) < 1e-6);
  assert.ok(Math.abs(minor_m - 4.8954937) < 1e-6);
});

test("the ellipse holds 95 % of the positions that are drawn from its covariance", () => {
  // A fixed linear congruential generator: the same positions in every run.
  let seed = 12345;
  const uniform = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  const normal = () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());
  // Two independent errors, mixed: covariance [[a² + b², bc], [bc, c²]].
  const [a, b, c] = [1.5, 1.1, 2.4];
  const { major_m, minor_m, angle_rad } = ellipse(a * a + b * b, c * c, b * c);
  let inside = 0;
  const n = 100_000;
  for (let i = 0; i < n; i++) {
    const [u, v] = [normal(), normal()];
    const [e, north] = [a * u + b * v, c * v];
    const along = (e * Math.cos(angle_rad) + north * Math.sin(angle_rad)) / major_m;
    const across = (-e * Math.sin(angle_rad) + north * Math.cos(angle_rad)) / minor_m;
    if (along * along + across * across <= 1) inside += 1;
  }
  assert.ok(Math.abs(inside / n - 0.95) < 0.004, `${inside / n} inside`);
});

test("the long axis of errors that go together points north-east", () => {
  const { angle_rad, major_m, minor_m } = ellipse(4, 4, 3, 1);
  assert.ok(Math.abs(angle_rad - Math.PI / 4) < 1e-12);
  assert.ok(Math.abs(major_m - Math.sqrt(7)) < 1e-12);
  assert.ok(Math.abs(minor_m - 1) < 1e-12);
});

test("a covariance a hair beyond singular gives a flat ellipse, not NaN", () => {
  assert.equal(ellipse(1, 1, 1 + 1e-12).minor_m, 0);
});

test("the worst sigma is never less than either axis'", () => {
  assert.ok(worstSigma([2, 3, 0], 1.5) >= 3);
  assert.equal(worstSigma([2, 3, 0], 0), 3);
});

test("candidates weigh distance by the covariance: the one along the long axis wins over a nearer one across it", () => {
  const places = [
    { name: "across", e_m: 0, n_m: 4 },
    { name: "along", e_m: 6, n_m: 0 },
  ];
  const ranked = rankPlaces([0, 0], [5, 1, 1], 0, places);
  assert.equal(ranked[0].place.name, "along");
  const named = ranked.reduce((sum, r) => sum + r.probability, 0);
  assert.ok(named < 1 && named > 0.8, `${named}`);
});

test("where no marker is near, none is called likely", () => {
  const ranked = rankPlaces([0, 0], [0.5, 0.5, 1], 0, [
    { e_m: 30, n_m: 0 },
    { e_m: 0, n_m: 300 },
  ]);
  assert.ok(ranked.every((r) => r.probability < 1e-6));
});

test("headings run clockwise from north, 0 to 360", () => {
  assert.equal(headingDegrees(-Math.PI / 2), 270);
  assert.equal(headingDegrees(0), 0);
});

test("the grid finds what a search through all nodes finds", () => {
  const { nodes } = makePlan();
  const grid = new SpatialIndex(nodes);
  for (const [e, n] of [
    [1.1, 0.4],
    [100.3, -51.7],
    [-230, 30],
    [245, 45],
  ]) {
    const all = nodes.map((p) => ({ name: p.name, d: Math.hypot(p.e_m - e, p.n_m - n) })).sort((a, b) => a.d - b.d);
    assert.deepEqual(
      grid.nearest(e, n, 5).map((f) => f.place.name),
      all.slice(0, 5).map((p) => p.name),
    );
  }
  assert.deepEqual(grid.nearest(5000, 0, 3), []);
  assert.equal(grid.named(" a17 ")?.name, "A17");
});
