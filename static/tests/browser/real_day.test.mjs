// A day where radio is banned, on a real server: two share a kiosk that is minutes off and has no link, one writes on paper; the
// logs are handed in at another computer in the evening.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;

/** The kiosk's *Start* comes so long before the log begins, s: its clock is four minutes off. */
const AHEAD_S = 240;
/** The walk that is handed in ends here, s: five stops. */
const END_S = 640;
const NAMES = ["李娜", "王芳", "Chen Wei"];

/** @typedef {{marker: string, t_s: number}} Stop */

describe("a day from the gate to the dock, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let kiosk;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let dock;
  /** @type {{left: Buffer, right: Buffer, stops: Stop[], start: number[]}[]} */
  const walks = [];

  before(async () => {
    real = await startReal();
    for (const [seed, name] of NAMES.entries()) {
      const { left, right, markers, visits, truth } = await real.walk("spiral", seed + 1);
      if (seed === 0) await real.post("/markers/import", markers, { "Content-Type": "text/csv" });
      await real.post("/inspectors", { name });
      const [, ...rows] = visits.trim().split("\n");
      const stops = rows
        .map((row) => row.split(","))
        .map(([from, to, marker]) => ({ marker, t_s: (Number(from) + Number(to)) / 2 }))
        .filter(({ t_s }) => t_s < END_S - 20);
      walks.push({ left: until(left), right: until(right), stops, start: startOf(truth) });
    }
    kiosk = await openPage(real.url);
    dock = await openPage(real.url);
  });
  after(async () => {
    await kiosk?.close();
    await dock?.close();
    await real?.stop();
  });

  test("two share the kiosk, without a link", { timeout: 120_000 }, async () => {
    const { page, context } = kiosk;
    await page.clock.install();
    await page.goto(`${real.url}/#/me`);
    await page.getByTestId("me").waitFor();
    await page.locator("select[name=who] option", { hasText: NAMES[1] }).waitFor({ state: "attached" });
    await context.setOffline(true);
    // The day goes by in steps, whatever a test takes.
    await page.clock.pauseAt(Date.now() + 10_000);
    let at_s = 0;
    const wait = async (/** @type {number} */ t_s) => {
      await page.clock.fastForward(Math.max(0, t_s - at_s) * 1000);
      at_s = Math.max(at_s, t_s);
    };
    for (const name of NAMES.slice(0, 2)) {
      await page.getByTestId("me-who").selectOption({ label: name });
      await page.getByRole("button", { name: "Start a walk" }).click();
      await page.getByText("Walking for").waitFor();
    }
    await page.getByTestId("me-sharing").getByText(NAMES[0]).waitFor();
    // All stops of both, in the order of the day; at the third of each a fault is seen and no marker is keyed in.
    const said = [0, 1]
      .flatMap((person) => walks[person].stops.map((stop, number) => ({ ...stop, person, number })))
      .sort((a, b) => a.t_s - b.t_s);
    for (const { person, number, marker, t_s } of said) {
      await wait(t_s + AHEAD_S);
      await page.getByTestId("me-who").selectOption({ label: NAMES[person] });
      if (number === 2) {
        const fault = page.getByTestId("me-fault");
        if (!(await fault.evaluate((el) => /** @type {HTMLDetailsElement} */ (el).open)))
          await fault.locator("summary").click();
        await page.getByTestId("me-report").click();
        continue;
      }
      for (const key of marker) await page.locator(`[data-key="${key}"]`).click();
      await page.getByTestId("me-enter").click();
      if ((await page.getByTestId("me-typed").textContent()) !== "–") await page.getByTestId("me-enter").click();
    }
    await page.clock.resume();
    await context.setOffline(false);
    await page.evaluate(() => dispatchEvent(new Event("online")));
    await page.getByText("Everything has been sent.").waitFor();
    const sessions = await real.get("/sessions/waiting");
    assert.deepEqual(
      sessions.map((/** @type {any} */ s) => [s.keyed, s.faults]),
      [
        [4, 1],
        [4, 1],
      ],
    );
  });

  test("in the evening the logs find their walks", { timeout: 240_000 }, async () => {
    const { page } = dock;
    const give = (/** @type {Record<string, Buffer | string>} */ files) =>
      page
        .getByTestId("files")
        .setInputFiles(
          Object.entries(files).map(([name, text]) => ({ name, mimeType: "text/csv", buffer: Buffer.from(text) })),
        );
    for (const [person, name] of NAMES.entries()) {
      const { left, right, stops, start } = walks[person];
      await page.goto("about:blank");
      await page.goto(`${real.url}/#/upload`);
      await page.getByTestId("drop").waitFor();
      if (person < 2) {
        await page.getByTestId("waiting").getByText(name).click();
        await page.getByTestId("unfinished-whose").getByText(name).waitFor();
        await give({ "left.csv": left, "right.csv": right });
      } else {
        // What was written on paper comes with the logs.
        await page.locator("select[name=inspector]").selectOption({ label: name });
        await page.locator("[name=start][value=position]").check();
        for (const [i, axis] of ["east", "north", "up"].entries())
          await page.locator(`input[name=${axis}]`).fill(String(start[i]));
        const rows = stops.map(({ marker, t_s }) => `${t_s + 37 - 4},${t_s + 37},${marker}`);
        await give({
          "left.csv": left,
          "right.csv": right,
          "visits.csv": `t_start_s,t_end_s,marker\n${rows.join("\n")}\n`,
        });
      }
      await page.getByRole("button", { name: "Upload" }).click();
      await page.getByTestId("upload-done").waitFor({ timeout: 120_000 });
    }
    assert.deepEqual(await real.get("/sessions/waiting"), []);
  });

  test("every visit is accepted, and every fault is at its actuator", async () => {
    const people = new Map((await real.get("/inspectors")).map((/** @type {any} */ i) => [i.id, i.name]));
    for (const { id, inspector_id } of await real.get("/sessions")) {
      const person = NAMES.indexOf(people.get(inspector_id));
      const { clock_tie } = await real.get(`/sessions/${id}`);
      assert.equal(clock_tie.state, "tied", JSON.stringify(clock_tie));
      const expected_s = person < 2 ? -AHEAD_S : -37;
      assert.ok(Math.abs(clock_tie.offset_s - expected_s) < 6, JSON.stringify(clock_tie));
      const visits = await real.get(`/sessions/${id}/visits`);
      assert.ok(
        visits.every((/** @type {any} */ v) => v.accepted),
        JSON.stringify(visits),
      );
    }
    const faults = await real.get("/faults");
    assert.equal(faults.length, 2);
    for (const fault of faults) {
      const person = NAMES.indexOf(people.get(fault.inspector_id));
      assert.equal(fault.candidates[0].marker, walks[person].stops[2].marker, JSON.stringify(fault));
    }
  });

  test("the walk shows how the clocks were tied, and the fault where it was before", async () => {
    const { page } = dock;
    const [walk] = (await real.get("/sessions")).filter((/** @type {any} */ s) => s.start.marker === null);
    await page.goto(`${real.url}/#/sessions/${walk.id}`);
    await page.locator("[data-testid=session][data-drawn=yes]").waitFor();
    await page.getByRole("tab", { name: "Markers" }).click();
    await page
      .getByTestId("clock-tie")
      .getByText(/of \d match/)
      .waitFor();
    const [fault] = await real.get("/faults");
    const history = await real.get(`/faults/${fault.id}/history`);
    assert.equal(history.filter((/** @type {any} */ change) => change.what === "place").length, 1);
  });

  test("nothing went wrong but the link that was cut", () => {
    const wrongs = [...kiosk.wrongs, ...dock.wrongs];
    assert.deepEqual(
      wrongs.filter((w) => !/ERR_INTERNET_DISCONNECTED|ERR_FAILED|WebSocket/.test(w)),
      [],
    );
  });
});

/** The rows of a log up to the end of the day. @param {Buffer} log */
function until(log) {
  const [head, ...rows] = log.toString().split("\n");
  const kept = rows.filter((row) => row !== "" && Number(row.slice(0, row.indexOf(","))) < END_S);
  return Buffer.from(`${head}\n${kept.join("\n")}\n`);
}

/** Where the walk begins, east, north, up, m. @param {string} truth */
const startOf = (truth) => truth.split("\n")[1].split(",").slice(1, 4).map(Number);
