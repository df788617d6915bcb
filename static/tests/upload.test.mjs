import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { test } from "node:test";
import { runUpload } from "../js/upload/run.js";
import { Sha256, sha256OfFile } from "../js/upload/sha256.js";
import { footOf, system } from "../js/systems/pedestrian.js";
import { PIECE_BYTES, handIn, sameFile } from "../js/upload/transfer.js";
import { setLanguage } from "../js/i18n.js";
import { readStart } from "../js/upload/start.js";

const reference = (bytes) => createHash("sha256").update(bytes).digest("hex");
const pattern = (n) => Uint8Array.from({ length: n }, (_, i) => (i * 131 + (i >> 7)) & 255);

test("the streaming digest is that of the standard, at every length around a block", () => {
  for (const n of [0, 1, 3, 55, 56, 57, 63, 64, 65, 119, 120, 127, 128, 1000, 100_003]) {
    const bytes = pattern(n);
    assert.equal(new Sha256().update(bytes).hex(), reference(bytes), `${n} bytes`);
  }
});

test("the digest does not depend on how the stream is cut", () => {
  const bytes = pattern(1000);
  for (const cut of [1, 7, 63, 64, 65, 300]) {
    const hash = new Sha256();
    for (let at = 0; at < bytes.length; at += cut) hash.update(bytes.subarray(at, at + cut));
    assert.equal(hash.hex(), reference(bytes));
  }
});

test("a file is hashed piece by piece and says how far it is", async () => {
  const bytes = pattern(2500);
  const seen = [];
  assert.equal(await sha256OfFile(new Blob([bytes]), (done) => seen.push(done), 1000), reference(bytes));
  assert.deepEqual(seen, [1000, 2000, 2500]);
});

class Refused extends Error {
  constructor(status, more = {}) {
    super(`refused ${status}`);
    this.status = status;
    Object.assign(this, more);
  }
}

/** A server of the contract, in memory, whose link can be made to fail. */
function server() {
  const logs = new Map();
  const calls = [];
  const faults = { beforeAppend: 0, afterAppend: 0, wrongOffset: 0 };
  return {
    logs,
    calls,
    faults,
    async createSession(body) {
      calls.push(["createSession", body]);
      return { id: "s1" };
    },
    async deleteSession() {
      calls.push(["deleteSession"]);
      return new Response(null, { status: 204 });
    },
    async beginLog(session, body) {
      calls.push(["beginLog", body.foot]);
      const known = [...logs.values()].find((l) => l.sha256 === body.sha256 && l.done && l.foot === body.foot);
      if (known) return { id: known.id, state: "unchanged" };
      const log = { id: `l${logs.size + 1}`, ...body, data: [], size: 0, done: false };
      logs.set(log.id, log);
      return { id: log.id, state: "receiving", offset_bytes: 0 };
    },
    async logOffset(id) {
      calls.push(["logOffset", id]);
      if (!logs.has(id)) throw new Refused(404);
      return logs.get(id).size;
    },
    async appendLog(id, offset, blob) {
      const log = logs.get(id);
      if (faults.beforeAppend > 0) {
        faults.beforeAppend -= 1;
        throw new TypeError("no route");
      }
      if (offset !== log.size) throw new Refused(409, { uploadOffset: log.size });
      log.data.push(new Uint8Array(await blob.arrayBuffer()));
      log.size += blob.size;
      calls.push(["appendLog", offset, blob.size]);
      if (faults.afterAppend > 0) {
        faults.afterAppend -= 1;
        throw new TypeError("answer lost");
      }
      return log.size;
    },
    /** @returns {Promise<any>} */
    async previewUpload(id, reading) {
      calls.push(["previewUpload", logs.get(id).size, reading]);
      return { format: "x_io", problem: null };
    },
    async finishLog(id, sha256, reading) {
      const log = logs.get(id);
      log.readAs = reading;
      assert.equal(reference(Buffer.concat(log.data)), sha256);
      log.done = true;
      return { id, state: "accepted" };
    },
    async addVisits() {
      calls.push(["addVisits"]);
      return /** @type {any} */ (null);
    },
    async processSession() {
      calls.push(["process"]);
      return { id: "j1", session_id: "s1", state: "running", stage: "filter", progress: 0 };
    },
    async job() {
      return { id: "j1", session_id: "s1", state: "finished", stage: "done", progress: 1 };
    },
  };
}
const file = (bytes, name = "left.csv") =>
  /** @type {File} */ (Object.assign(new Blob([bytes]), { name, lastModified: 0 }));
const noWait = async () => {};

test("a log goes up in pieces and is accepted", async () => {
  const api = server();
  const bytes = pattern(PIECE_BYTES + 10);
  const stages = new Set();
  const { state } = await handIn(api, {
    sessionId: "s1",
    stream: { foot: "left" },
    file: file(bytes),
    onProgress: (p) => stages.add(p.stage),
    wait: noWait,
  });
  assert.equal(state, "accepted");
  assert.deepEqual(
    api.calls.filter((c) => c[0] === "appendLog"),
    [
      ["appendLog", 0, PIECE_BYTES],
      ["appendLog", PIECE_BYTES, 10],
    ],
  );
  assert.deepEqual([...stages], ["hashing", "sending", "checking", "accepted"]);
});

test("a cut before and a lost answer after a piece cost at most that piece, and no byte is sent twice into the log", async () => {
  const api = server();
  api.faults.beforeAppend = 2;
  api.faults.afterAppend = 1;
  const bytes = pattern(PIECE_BYTES * 2 + 5);
  const { state } = await handIn(api, { sessionId: "s1", stream: { foot: "left" }, file: file(bytes), wait: noWait });
  assert.equal(state, "accepted");
  assert.equal(reference(Buffer.concat([...api.logs.values()][0].data)), reference(bytes));
});

test("a log that is here already is success, and nothing is sent", async () => {
  const api = server();
  const bytes = pattern(5000);
  await handIn(api, { sessionId: "s1", stream: { foot: "left" }, file: file(bytes), wait: noWait });
  const before = api.calls.length;
  const { state } = await handIn(api, { sessionId: "s1", stream: { foot: "left" }, file: file(bytes), wait: noWait });
  assert.equal(state, "unchanged");
  assert.deepEqual(api.calls.slice(before), [["beginLog", "left"]]);
});

test("after a refresh the same file goes on where the server is", async () => {
  const api = server();
  const bytes = pattern(PIECE_BYTES * 2);
  const sha256 = reference(bytes);
  const begun = await api.beginLog("s1", { foot: "left", file_name: "x", size_bytes: bytes.length, sha256 });
  await api.appendLog(begun.id, 0, new Blob([bytes.subarray(0, PIECE_BYTES)]));
  const before = api.calls.length;
  await handIn(api, {
    sessionId: "s1",
    stream: { foot: "left" },
    file: file(bytes),
    begun: { log_id: begun.id, sha256 },
    wait: noWait,
  });
  assert.deepEqual(api.calls.slice(before), [
    ["logOffset", "l1"],
    ["appendLog", PIECE_BYTES, PIECE_BYTES],
  ]);
});

test("another file in place of the cut one begins a log of its own", async () => {
  const api = server();
  const begun = await api.beginLog("s1", { foot: "left", file_name: "x", size_bytes: 3, sha256: "00" });
  await handIn(api, {
    sessionId: "s1",
    stream: { foot: "left" },
    file: file(pattern(100)),
    begun: { log_id: begun.id, sha256: "00" },
    wait: noWait,
  });
  assert.equal(api.logs.size, 2);
});

test("a cut log that the server has forgotten is begun anew", async () => {
  const api = server();
  const bytes = pattern(100);
  const { state } = await handIn(api, {
    sessionId: "s1",
    stream: { foot: "left" },
    file: file(bytes),
    begun: { log_id: "gone", sha256: reference(bytes) },
    wait: noWait,
  });
  assert.equal(state, "accepted");
});

test("a refusal is thrown at once, not tried again", async () => {
  const api = server();
  api.finishLog = async () => {
    throw new Refused(422, { code: "wrong_column" });
  };
  let waits = 0;
  await assert.rejects(
    handIn(api, {
      sessionId: "s1",
      stream: { foot: "left" },
      file: file(pattern(10)),
      wait: async () => {
        waits += 1;
      },
    }),
    { status: 422 },
  );
  assert.equal(waits, 0);
});

test("the whole of it: session, both feet, visits, processing; the note of the cut upload goes at the end", async () => {
  const api = server();
  const notes = [];
  const jobs = [];
  const { session_id, unchanged } = await runUpload(api, system, {
    files: { left: file(pattern(10)), right: file(pattern(20), "right.csv") },
    visits: file(pattern(5), "visits.csv"),
    session: { inspector_id: "i1" },
    unfinished: null,
    onLog() {},
    onJob: (job) => jobs.push(job.state),
    remember: (note) => notes.push(structuredClone(note)),
    wait: noWait,
  });
  assert.equal(session_id, "s1");
  assert.equal(unchanged, false);
  assert.deepEqual(api.calls[0], ["createSession", { inspector_id: "i1", feet: ["left", "right"] }]);
  assert.deepEqual(api.calls.slice(-2), [["addVisits"], ["process"]]);
  assert.deepEqual(jobs, ["running", "finished"]);
  assert.deepEqual(Object.keys(notes.at(-2).logs), ["left", "right"]);
  assert.equal(notes.at(-1), null);
});

test("a log that was refused leaves no walk that was begun for it; one that waited for its logs stays", async () => {
  const refuse = async (/** @type {any} */ unfinished, goes = true) => {
    const api = server();
    api.finishLog = async () => {
      throw new Refused(422);
    };
    if (!goes)
      api.deleteSession = async () => {
        throw new Refused(403);
      };
    let note;
    await assert.rejects(
      runUpload(api, system, {
        files: { left: file(pattern(9)) },
        visits: null,
        session: {},
        unfinished,
        onLog() {},
        onJob() {},
        remember: (n) => {
          note = structuredClone(n);
        },
        wait: noWait,
      }),
      { status: 422 },
    );
    return { note, deleted: api.calls.filter(([name]) => name === "deleteSession").length };
  };
  const waits = { session_id: "s1", system: "pedestrian", title: "", logs: {} };
  assert.deepEqual(await refuse(null), { note: null, deleted: 1 });
  assert.deepEqual(await refuse(waits), { note: waits, deleted: 0 });
  // What cannot be removed is remembered, to be gone on with or given up.
  assert.deepEqual(await refuse(null, false), { note: waits, deleted: 0 });
});

test("a walk that holds one foot already stays when the other is refused", async () => {
  const api = server();
  const { finishLog } = api;
  api.finishLog = async (...asked) => {
    if (api.logs.size > 1) throw new Refused(422);
    return finishLog.call(api, ...asked);
  };
  let note;
  await assert.rejects(
    runUpload(api, system, {
      files: { left: file(pattern(9)), right: file(pattern(8)) },
      visits: null,
      session: {},
      unfinished: null,
      onLog() {},
      onJob() {},
      remember: (n) => {
        note = structuredClone(n);
      },
      wait: noWait,
    }),
  );
  assert.deepEqual(Object.keys(note.logs), ["left"]);
  assert.ok(!api.calls.some(([name]) => name === "deleteSession"));
});

test("one file given twice is found by its bytes, whatever it is called", async () => {
  const bytes = pattern(200_000);
  const last = Uint8Array.from(bytes);
  last[199_999] ^= 1;
  assert.equal(await sameFile(file(bytes, "left.csv"), file(bytes, "right.csv")), true);
  assert.equal(await sameFile(file(bytes), file(last)), false);
  assert.equal(await sameFile(file(bytes), file(bytes.subarray(1))), false);
});

test("one foot alone is a session of one foot", async () => {
  const api = server();
  await runUpload(api, system, {
    files: { right: file(pattern(20)) },
    visits: null,
    session: {},
    unfinished: null,
    onLog() {},
    onJob() {},
    remember() {},
    wait: noWait,
  });
  assert.deepEqual(api.calls[0][1].feet, ["right"]);
});

test("the foot is read from the file's name, and left open when the name does not say", () => {
  for (const name of ["walk.left.csv", "LEFT_0701.csv.gz", "imu-L.csv", "左脚.csv", "stair_up.left.csv"])
    assert.equal(footOf(name), "left", name);
  for (const name of ["right.csv", "run3_R.csv", "0701右.csv", "rightfoot.csv"])
    assert.equal(footOf(name), "right", name);
  for (const name of ["walk.csv", "left_right.csv", "helloworld.csv", "control.csv"])
    assert.equal(footOf(name), null, name);
});

test("a start is read as typed, and what is wrong is said in words", () => {
  setLanguage("en", {
    "upload.need_number": "{field} {found}",
    "axis.north_m": "North",
    "upload.need_marker": "marker!",
  });
  const form = (entries) => /** @type {FormData} */ (/** @type {unknown} */ (new Map(Object.entries(entries))));
  assert.deepEqual(
    readStart(form({ start: "marker", marker: "a17" }), () => "A17"),
    { start: { marker: "A17" } },
  );
  assert.deepEqual(
    readStart(form({ start: "position", east: "1,5", north: "-2", up: "0", heading: "90" }), () => undefined),
    { start: { position_m: [1.5, -2, 0] }, initial_heading_deg: 90 },
  );
  assert.deepEqual(
    readStart(form({ start: "origin" }), () => undefined),
    {},
  );
  assert.throws(
    () => readStart(form({ start: "position", east: "1", north: "x", up: "0" }), () => undefined),
    /North x/,
  );
  assert.throws(() => readStart(form({ start: "marker", marker: " " }), () => undefined), /marker!/);
});

test("a dry run sends the log, looks at the whole of it and stores nothing; handing in then only finishes", async () => {
  const api = server();
  const bytes = pattern(500);
  const reading = { rate_hz: 100 };
  let unfinished = null;
  const task = {
    files: { left: file(bytes) },
    visits: null,
    session: { title: "T" },
    onLog() {},
    onJob() {},
    readings: { left: reading },
    wait: noWait,
  };
  const dry = await runUpload(api, system, {
    ...task,
    unfinished,
    remember: (/** @type {any} */ u) => (unfinished = u && structuredClone(u)),
    dryRun: true,
  });
  assert.equal(dry.looked.left?.format, "x_io");
  assert.deepEqual(
    api.calls.filter(([name]) => name === "previewUpload" || name === "process"),
    [["previewUpload", 500, reading]],
  );
  assert.equal(api.logs.get("l1").done, false);
  const whole = await runUpload(api, system, { ...task, unfinished, remember() {} });
  assert.equal(whole.session_id, dry.session_id);
  assert.equal(api.calls.filter(([name]) => name === "appendLog").length, 1);
  assert.deepEqual([api.logs.get("l1").done, api.logs.get("l1").readAs], [true, reading]);
});
