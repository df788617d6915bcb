import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import { before, test } from "node:test";
import { setLanguage } from "../js/i18n.js";
import * as kit from "../js/replay/plots.js";
import { readTrack } from "../js/sessions/track.js";
import { generic } from "../js/systems/generic.js";
import {
  aboutAnomaly,
  isUnknown,
  keyOf,
  learnSystems,
  loadSystem,
  openSystem,
  streamName,
  systemNames,
  systemOf,
  word,
} from "../js/systems/index.js";
import { runUpload } from "../js/upload/run.js";
import { RAFT } from "./mock/systems.mjs";

const root = new URL("..", import.meta.url);
const read = (/** @type {string} */ path) => readFile(new URL(path, root), "utf8");
const words = async (/** @type {string} */ file) => JSON.parse(await read(`messages/${file}.json`));

/** Files that belong to every system, with their text. */
async function sharedFiles() {
  const inFolder = async (/** @type {string} */ folder) =>
    (await readdir(new URL(folder, root), { recursive: true })).map((name) => `${folder}${name}`);
  const names = [
    ...(await inFolder("js/")),
    ...(await inFolder("css/")),
    ...(await inFolder("messages/")),
    "index.html",
    "sw.js",
  ];
  const shared = names.filter(
    (name) => /\.(js|css|json|html)$/.test(name) && !/\/(pedestrian|pole|cabin|rover)[._]/.test(name),
  );
  return Promise.all(shared.map(async (name) => /** @type {const} */ ([name, await read(name)])));
}

/** What only feet have: the word itself wherever it stands, in names and in both languages, … */
const OF_FEET = [
  /foot|feet|shoe|stride|(?<![a-z])stance|cadence/iu,
  /(?<!不)足|脚(?!本)/u,
  // … the names of aids that are theirs alone, …
  /zupt|\bmaru\b|separation|altimeter/iu,
  // … and the two of them by name: as a column or key (not what was put right), or as a value. The sides of a box, of text and of the map's
  // corner are none of these: `.left`, `textAlign = "right"`, `topLeft`.
  /\b(left|right)_|(?<!put)_(left|right)\b/u,
  /(?<!textAlign = .*)["'`](left|right)["'`]/u,
];

test("no shared file of the page names a foot", async () => {
  const files = await sharedFiles();
  assert.ok(files.length > 90, `${files.length} files`);
  const found = files.flatMap(([name, text]) =>
    text.split("\n").flatMap((line, i) => {
      const named = OF_FEET.map((pattern) => pattern.exec(line)?.[0]).find((match) => match);
      return named ? [`${name}:${i + 1}: ${named}`] : [];
    }),
  );
  assert.deepEqual(found, []);
});

test("only the index names the systems that have a file of their own", async () => {
  const naming = (await sharedFiles()).filter(([, text]) => /pedestrian/i.test(text)).map(([name]) => name);
  assert.deepEqual(naming, ["js/systems/index.js", "index.html"]);
});

/** @type {any} */
const api = { systems: async () => ({ systems: [RAFT] }) };

before(async () => {
  setLanguage("en", { ...(await words("en")), ...(await words("pedestrian.en")) });
  await loadSystem("pedestrian");
});

test("a session that names no system is the first one's, and one of an unknown system has no streams until the server has declared it", async () => {
  assert.equal(systemOf({}).name, "pedestrian");
  assert.equal(systemOf(null).name, "pedestrian");
  const session = { system: "raft" };
  assert.deepEqual([isUnknown(session), isUnknown({ system: "pedestrian" }), isUnknown({})], [true, false, false]);
  assert.deepEqual([systemOf(session).name, systemOf(session).uploadSlots], ["raft", []]);
  let times = 0;
  const failing = { systems: () => Promise.reject(new Error(`no ${(times += 1)}`)) };
  assert.equal(await learnSystems(failing), false);
  assert.equal(await learnSystems(failing), false);
  assert.equal(times, 2);
  assert.equal(await learnSystems(api), true);
  assert.deepEqual([isUnknown(session), systemNames()], [false, ["raft"]]);
  assert.deepEqual(
    systemOf(session).uploadSlots.map(({ stream }) => stream),
    ["bow", "range_1", "range_2"],
  );
});

test("a declared system has its words from the server, the page's own where there are some", () => {
  const raft = generic(RAFT);
  assert.equal(word(raft, "title"), "Raft");
  assert.equal(streamName(raft, "bow"), "Sensor at the bow");
  assert.equal(word(raft, "aid.echo"), "echo");
  assert.equal(word(raft, "aid.markers"), "Markers");
  assert.equal(word(raft, "plot.nis_echo"), "NIS, echo");
  assert.equal(word(raft, "plot.speed"), "Speed");
  assert.equal(word(raft, "anomaly.gap"), "Gap in the data");
  assert.equal(word(raft, "anomaly.run_aground"), "run aground");
  assert.equal(aboutAnomaly(raft, "gap"), word(raft, "anomaly.about.gap"));
  assert.equal(aboutAnomaly(raft, "run_aground"), "");
  assert.equal(word(raft, "anomaly.never_heard_of"), "never_heard_of");
  assert.equal(keyOf(raft, "upload.lead"), "upload.lead");
});

test("a declared system's logs: by the stream in the file's name, under its own name at the server", async () => {
  const raft = generic(RAFT);
  const shape = raft.uploadSlots.map(({ stream, kind, required }) => ({ stream, kind, required }));
  assert.deepEqual(shape, [
    { stream: "bow", kind: "imu", required: true },
    { stream: "range_1", kind: "values", required: false },
    { stream: "range_2", kind: "values", required: false },
  ]);
  assert.deepEqual(["2026_BOW.csv", "range_1.csv.gz", "bow_range_1.csv", "log.csv"].map(raft.slotOf), [
    "bow",
    "range_1",
    null,
    null,
  ]);
  assert.equal(raft.streamOf({ stream: "bow" }), "bow");
  /** @type {any[]} */
  const calls = [];
  const note =
    (/** @type {string} */ name, /** @type {any} */ answer) =>
    async (/** @type {any[]} */ ...given) => {
      calls.push([name, ...given]);
      return answer;
    };
  /** @type {any} */
  const server = {
    createSession: note("createSession", { id: "s1" }),
    beginLog: note("beginLog", { id: "l1", state: "unchanged" }),
    processSession: note("process", { id: "j1", state: "finished" }),
  };
  const log = /** @type {File} */ (Object.assign(new Blob(["x"]), { name: "bow.csv", lastModified: 0 }));
  await runUpload(server, raft, {
    files: { bow: log },
    visits: null,
    session: {},
    unfinished: null,
    onLog() {},
    onJob() {},
    remember() {},
  });
  assert.deepEqual(calls[0], ["createSession", { system: "raft", streams: ["bow"] }]);
  assert.equal(calls[1][2].stream, "bow");
});

test("a declared system is drawn: the charts of every system, its aids, and its own in their own units", () => {
  const raft = generic(RAFT);
  const plots = raft.plots(kit);
  const ids = plots.map(({ id }) => id);
  assert.equal(new Set(ids).size, ids.length);
  assert.deepEqual(
    ids.filter(
      (id) => !["speed", "heading", "sigma_plan", "sigma_up", "sigma_heading", "height", "nis_markers"].includes(id),
    ),
    ["nis_echo", "depth"],
  );
  for (const { group } of plots) assert.ok(raft.plotGroups.includes(group), group);
  for (const group of raft.firstPlotGroups) assert.ok(raft.plotGroups.includes(group), group);
  const depth = plots.find(({ id }) => id === "depth");
  assert.deepEqual(
    [depth?.unit, depth?.lines.map(({ series }) => series)],
    ["m", ["bow", "range_1", "range_2", "keel", "without_markers", "filtered", "main"]],
  );
  assert.deepEqual(kit.chartsOf([], raft.readouts), ["speed"]);
});

test("a track is read with the columns of its system and no others", () => {
  const columns = ["t_s", "e_m", "n_m", "u_m", "heading_rad", "sigma_e_m", "sigma_n_m"];
  const table = { run: "main", columns, rows: [[0, 1, 2, 3, null, 0.3, 0.4]] };
  const track = readTrack(table, generic(RAFT));
  assert.deepEqual([track.sigma_m[0], track.heading_rad[0], track.more], [0.5, NaN, {}]);
  assert.throws(() => readTrack(table, systemOf({})), /no column left_stance/);
});

test("a rover's track is cut where its quality changes, and its files are told apart by their endings", async () => {
  const { byQuality, refined, slotOf } = await import("../js/systems/rover.js");
  const track = { t_s: [0, 1, 2, 3], e_m: [0, 10, 20, 30], n_m: [0, 0, 0, 5] };
  const line = { chart: "quality", series: "main", start_s: 0, step_s: 1, low: [1, 1, 2, 3] };
  const pieces = byQuality(/** @type {any} */ (track), line);
  assert.deepEqual(
    pieces.map(({ points, ink }) => [ink, points.length]),
    // A piece begins where the one before ends; the last line is there for its ends alone.
    [
      ["5", 2],
      ["warn", 2],
      ["runA", 2],
      ["runA", 4],
    ],
  );
  assert.deepEqual(byQuality(/** @type {any} */ (track), undefined), []);
  assert.deepEqual(
    ["base.nav", "BRDC00IGS_R_20243180000_01D_MN.rnx.gz", "base.obs.gz", "rover.24o", "uwb.csv", "x.bin"].map(slotOf),
    ["navigation_1", "navigation_1", "base", "rover", "ranges", null],
  );
  const rover = refined(generic({ ...RAFT, name: "rover" }));
  const plots = rover.plots(kit);
  assert.ok(plots.every(({ group }) => rover.plotGroups.includes(group)));
  setLanguage("en", { ...(await words("en")), ...(await words("rover.en")) });
  const values = { quality: 1, satellites: 14, anchors: 3, ratio: 12.34 };
  const moment = {
    point: () => null,
    chart: (/** @type {string} */ chart) => values[/** @type {"ratio"} */ (chart)] ?? null,
  };
  assert.deepEqual(
    rover.readouts.map((readout) => readout.words(moment)),
    ["fixed: whole cycles", "14 + 3", "12.3"],
  );
});

test("what a system has beside its declaration comes with its words when a session of it is opened", async () => {
  const { refined } = await import("../js/systems/pole.js");
  const declared = generic({
    ...RAFT,
    name: "pole",
    parts: [
      { name: "tip", title: "Tip" },
      { name: "antenna", title: "Antenna" },
    ],
    aids: [{ name: "fix" }, { name: "tip" }],
  });
  const pole = refined(declared);
  assert.deepEqual([pole.uploadSlots, pole.instrument], [declared.uploadSlots, declared.instrument]);
  const plots = pole.plots(kit);
  assert.deepEqual(
    plots.filter(({ group }) => group === "innovations").map(({ id }) => id),
    ["nis_fix", "nis_tip", "nis_markers"],
  );
  assert.ok(plots.every(({ group }) => pole.plotGroups.includes(group)));
  setLanguage("en", { ...(await words("en")), ...(await words("pole.en")) });
  const at = (/** @type {number | null} */ value) =>
    pole.readouts[0].words({ point: () => null, chart: (_, series) => (series === "tip" ? value : null) });
  assert.deepEqual([1, 0, null].map(at), ["Tip on the ground", "Tip in the air", "Tip –"]);
  assert.equal(word(pole, "anomaly.no_heading"), "North not found");
  assert.equal(word(pole, "session.visits_used"), "points visited");
  assert.ok(pole.plan);
  // One that is not known, or has nothing more, stays as it is.
  await openSystem("raft");
  assert.equal(systemOf({ system: "raft" }).name, "raft");
});

test("the way of a pole has the ink of the fixes that it rests on, and its landings stand in their middle", async () => {
  const { byFixes, landed } = await import("../js/systems/pole.js");
  const t_s = [0, 1, 2, 3, 4, 5, 6];
  const track = /** @type {any} */ ({ t_s, e_m: t_s.map((t) => 2 * t), n_m: t_s.map(() => 1) });
  const line = (/** @type {(number | null)[]} */ low) => /** @type {any} */ ({ start_s: 0, step_s: 1, low });
  // A fix, a float, and nothing for long: it rests on the last one for a second.
  const pieces = byFixes(track, line([1, 1, 2, null, null, null, 1]));
  assert.deepEqual(
    pieces.map(({ ink, points }) => [ink, points[0][0], points.at(-1)?.[0]]),
    [
      ["arrow", 0, 2],
      ["warn", 2, 6],
      ["muted", 6, 10],
      ["arrow", 10, 12],
    ],
  );
  assert.deepEqual(landed(track, line([1, 1, 1, 0, 0, 1, 1])), [
    [2, 1],
    [11, 1],
  ]);
  assert.deepEqual([byFixes(track, undefined), landed(track, undefined)], [[], []]);
});
