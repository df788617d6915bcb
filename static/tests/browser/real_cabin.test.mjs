// A run of the feed cabin on a real server: handed in by REST, opened, its board drawn; and a live one, whose poses come by the socket.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;
const FILES = {
  imu: "imu.csv",
  platform_imu: "platform_imu.csv",
  gnss: "antennas.csv",
  stations: "stations.csv",
  encoders: "encoders.csv",
  plan: "plan.csv",
};

describe("the feed cabin, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;
  let folder = "";
  /** @type {{id: string, instrument: string}} */
  let session;

  before(async () => {
    real = await startReal();
    folder = await mkdtemp(join(tmpdir(), "lodestep-cabin-"));
    const line = ["simulate", "cabin", "--out", folder, "--hold-s", "8", "--slew-s", "8", "--track-s", "24"];
    const done = spawnSync((await findServer()) ?? "", [...line, "--fault", "wrong_fix.2@24..32"], {
      encoding: "utf8",
    });
    assert.equal(done.status, 0, done.stderr);
    const inspector = await real.post("/inspectors", { name: "馈源舱" });
    const instrument = await readFile(join(folder, "cabin.toml"), "utf8");
    const streams = Object.keys(FILES);
    session = await real.post("/sessions", { inspector_id: inspector.id, system: "cabin", streams, instrument });
    for (const [stream, name] of Object.entries(FILES))
      await real.handInOne(session.id, { stream }, await readFile(join(folder, name)));
    await real.process(session.id);
    tab = await openPage(real.url);
  });
  after(async () => {
    await tab?.close();
    await real?.stop();
    if (folder) await rm(folder, { recursive: true });
  });

  test("a finished run shows where cabin and platform were and should have been, its charts and what was wrong", async () => {
    const { page } = tab;
    await page.goto(`${real.url}/#/sessions/${session.id}?t=30`);
    await page.locator("[data-testid=session][data-drawn=yes][data-charted=yes]").waitFor({ timeout: 30_000 });
    const state = page.getByTestId("cabin-state");
    await becomes(async () => /full|reduced/.test((await state.textContent()) ?? ""), true);
    const words = (await state.textContent()) ?? "";
    assert.match(words, /Cabin\s+Sigma \d+\.\d mm\s+Protection level \d+\.\d mm/);
    assert.match(words, /Platform\s+Sigma \d+\.\d mm/);
    // The plan is known, and something is drawn on each canvas.
    assert.doesNotMatch(words, /No plan/);
    const inked = await page.locator(".board canvas").evaluateAll((all) =>
      all.map((canvas) => {
        const paper = /** @type {HTMLCanvasElement} */ (canvas);
        const pixels = paper.getContext("2d")?.getImageData(0, 0, paper.width, paper.height).data ?? [];
        return pixels.filter((value, i) => i % 4 === 3 && value > 0).length;
      }),
    );
    assert.equal(inked.length, 7);
    for (const pixels of inked) assert.ok(pixels > 200, `${inked}`);
    // The antenna that is shut out, with the reason, and since when.
    await page.getByTestId("cabin-out").getByText("A3 · Wrong fix").waitFor();
    await page.getByTestId("cabin-changes").getByText("without A3").first().waitFor();
    await page.locator("[data-plot=off_plan_platform]").waitFor();
    await page.locator("[data-plot=off_plan_angles_platform]").waitFor();
    await page.getByRole("tab", { name: "Quality" }).click();
    await page.getByText("A3 is told as fixed and is off by").first().waitFor();
    if (process.env.LODESTEP_PICTURE) {
      await page.getByRole("tab", { name: "Replay" }).click();
      await page.screenshot({ path: process.env.LODESTEP_PICTURE, animations: "disabled" });
    }
  });

  test("the board shows the poses of a run that is streamed as they come", async () => {
    const { page } = tab;
    const { inspector_id, instrument } = await real.get(`/sessions/${session.id}`);
    const messages = await streamed(folder);
    const id = await page.evaluate(
      async ({ hello }) => {
        const socket = new WebSocket(`${location.origin.replace("http", "ws")}/api/v1/live`);
        Object.assign(window, { device: socket });
        await new Promise((resolve) => (socket.onopen = resolve));
        socket.send(JSON.stringify(hello));
        const welcome = await new Promise((resolve) => (socket.onmessage = ({ data }) => resolve(JSON.parse(data))));
        return welcome.session_id;
      },
      { hello: { type: "hello", inspector_id, system: "cabin", streams: Object.keys(FILES), instrument } },
    );
    // Another session of the same page: the device goes on meanwhile.
    await page.evaluate((hash) => void (location.hash = hash), `#/sessions/${id}`);
    const state = page.getByTestId("cabin-state");
    await state.getByText("No pose comes").waitFor();
    await page.evaluate(async (all) => {
      const { device } = /** @type {any} */ (window);
      for (const message of all) {
        const answer = new Promise((resolve) => (device.onmessage = resolve));
        device.send(JSON.stringify(message));
        await answer;
      }
    }, messages);
    const words = (await state.textContent()) ?? "";
    // The moment's last rows of the stations may come after those of the inertial units: it coasts until then.
    await becomes(async () => /State\s*(full|reduced|silent)/.test((await state.textContent()) ?? ""), true);
    assert.match(words, /Cabin\s+Sigma \d+\.\d mm\s+Protection level \d+\.\d mm/);
    assert.match(words, /Age of the data/);
    if (process.env.LODESTEP_PICTURE) {
      await page.locator(".board canvas").first().scrollIntoViewIfNeeded();
      await page.screenshot({ path: process.env.LODESTEP_PICTURE.replace(".png", "-live.png"), fullPage: true });
    }
    assert.deepEqual(
      tab.wrongs.filter((wrong) => !/422|404|409/.test(wrong)),
      [],
    );
  });
});

/**
 * The rows of a run as a device sends them: batches of half a second, in the order of time. Devices are named by their places.
 * @param {string} folder
 */
async function streamed(folder) {
  const batches = [];
  for (const [stream, name] of Object.entries(FILES)) {
    const [, ...lines] = (await readFile(join(folder, name), "utf8")).trim().split("\n");
    /** @type {Map<number, any[]>} */
    const cells = new Map();
    for (const line of lines) {
      const [t_s, ...values] = line.split(",");
      const numbers = values.map((value) => {
        const named = /^([A-Z])(\d+)$/.exec(value);
        return named ? Number(named[2]) + (named[1] === "P" ? 6 : 0) : Number(value);
      });
      const t_ns = Math.round(Number(t_s) * 1e9);
      const cell = Math.floor(Number(t_s) * 2);
      const row = stream.endsWith("imu") ? [t_ns, ...numbers, null, null, null, null] : [t_ns, numbers];
      cells.set(cell, [...(cells.get(cell) ?? []), row]);
    }
    [...cells.entries()].forEach(([cell, rows], sequence) => {
      const readings = stream.endsWith("imu") ? { samples: rows } : { rows };
      batches.push({ cell, message: { type: "batch", stream, sequence, ...readings } });
    });
  }
  return batches.toSorted((a, b) => a.cell - b.cell).map(({ message }) => message);
}
