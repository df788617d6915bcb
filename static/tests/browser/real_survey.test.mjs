// A survey with the pole on a real server: handed in by REST, its points looked at, compared with the markers, and taken over.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;
const FILES = { imu: "imu.csv", gnss: "gnss.csv", switch: "contact.csv" };
/** By how much the old coordinate of the marker is off, east and north, m. */
const OFF = [0.3, -0.2];

/** The first row of a table of ours. @param {string} text @returns {Record<string, string>} */
function row(text) {
  const [head, first] = text.split("\n").map((line) => line.split(","));
  return Object.fromEntries(head.map((name, i) => [name, first[i]]));
}

describe("a survey becomes markers, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;
  let folder = "";
  let session = "";
  /** @type {Record<string, string>} */
  let truth;

  before(async () => {
    folder = await mkdtemp(join(tmpdir(), "lodestep-survey-"));
    const done = spawnSync((await findServer()) ?? "", ["simulate", "pole", "--route", "I20", "--out", folder], {
      encoding: "utf8",
    });
    assert.equal(done.status, 0, done.stderr);
    const text = (/** @type {string} */ name) => readFile(join(folder, name), "utf8");
    const pole = await text("pole.toml");
    await writeFile(join(folder, "site.toml"), pole.split("[pole]")[0].replace("[site]", ""));
    process.env.LODESTEP_SITE = join(folder, "site.toml");
    real = await startReal();
    delete process.env.LODESTEP_SITE;
    truth = row(await text("points_truth.csv"));
    const old = [Number(truth.e_m) + OFF[0], Number(truth.n_m) + OFF[1], Number(truth.u_m)];
    await real.post("/markers/import", `name,e_m,n_m,u_m\nT,${old.join(",")}\n`, { "Content-Type": "text/csv" });
    const inspector = await real.post("/inspectors", { name: "李娜" });
    const streams = Object.keys(FILES);
    const made = { inspector_id: inspector.id, system: "pole", streams, instrument: pole };
    session = (await real.post("/sessions", made)).id;
    for (const [stream, name] of Object.entries(FILES))
      await real.handInOne(session, { stream }, await readFile(join(folder, name)));
    const { t_start_s, t_end_s } = row(await text("points.csv"));
    const visit = { marker: "T", t_start_s: Number(t_start_s), t_end_s: Number(t_end_s) };
    await real.post(`/sessions/${session}/visits`, visit);
    await real.process(session);
    tab = await openPage(real.url);
  });
  after(async () => {
    await tab?.close();
    await real?.stop();
    if (folder) await rm(folder, { recursive: true });
  });

  test("its points are listed with their sigmas, and its own words say what it is", async () => {
    const { page } = tab;
    await page.goto(`${real.url}/#/sessions/${session}`);
    await page.locator("[data-testid=session][data-beyond=yes]").waitFor({ timeout: 30_000 });
    const cells = await page.getByTestId("surveyed-points").locator("tbody td").allTextContents();
    assert.equal(cells[0], "T");
    const number = (/** @type {string} */ text) => Number(text.replace("−", "-"));
    assert.ok(Math.abs(number(cells[1]) + OFF[0]) < 0.1 && Math.abs(number(cells[2]) + OFF[1]) < 0.1, String(cells));
    const sigmas = cells.slice(4, 7).map(number);
    assert.ok(
      sigmas.every((sigma) => sigma > 0.001 && sigma < 0.1),
      String(cells),
    );
    const words = (await page.locator("#side").textContent()) ?? "";
    assert.match(words, /points visited/);
    assert.doesNotMatch(words, /with markers|markers used/);
    await page.locator("#legend").getByText("landings").waitFor();
    assert.deepEqual(tab.wrongs, []);
  });

  test("one click compares them with the table, and the survey stands in the marker's history when it is applied", async () => {
    const { page } = tab;
    await page.getByTestId("import-survey").click();
    const difference = page.getByTestId("difference");
    await difference.getByText("σ E N U, m").waitFor();
    const cells = await difference.locator("tbody tr td").allTextContents();
    const moves_m = Number(cells[2]);
    assert.ok(Math.abs(moves_m - Math.hypot(...OFF)) < 0.1, String(cells));
    assert.ok(Number(cells[4]) > 3, String(cells));
    assert.match(cells[5], /^0\.0\d+ 0\.0\d+ 0\.0\d+$/);
    const before = await real.get("/markers/T");
    assert.ok(Math.abs(before.e_m - Number(truth.e_m) - OFF[0]) < 1e-3, "nothing is changed yet");
    await page.locator("form.apply [name=reason]").fill("surveyed anew");
    const accept = page.locator("form.apply [name=accept]");
    if (await accept.count()) await accept.check();
    await page.getByTestId("apply-import").click();
    await becomes(async () => {
      const now = await real.get("/markers/T");
      return Math.hypot(now.e_m - Number(truth.e_m), now.n_m - Number(truth.n_m)) < 0.1;
    }, true);
    await page.locator("[data-step=back]").click();
    await page.locator('[data-marker="T"]').click();
    const source = page.getByTestId("history").getByTestId("survey-source");
    await source.waitFor();
    assert.equal(await source.getAttribute("href"), `#/sessions/${session}`);
    assert.deepEqual(tab.wrongs, []);
  });

  test("surveying programs get the points as they read them", async () => {
    const pnezd = await real.get(`/sessions/${session}/surveyed-points.txt`);
    assert.match(pnezd, /^T,-?\d+\.\d{4},-?\d+\.\d{4},-?\d+\.\d{4},sigma /);
    assert.match(await real.get(`/sessions/${session}/surveyed-points.xml`), /<CgPoint name="T"/);
    assert.match(await real.get(`/sessions/${session}/surveyed-points.csv`), /^name,lat_deg,/);
  });

  test("what to expect is there before anybody has walked", async () => {
    const { page } = tab;
    await page.goto(`${real.url}/#/upload/pole`);
    await page.getByText("Hand in a survey").first().waitFor();
    const plan = page.getByTestId("forecast");
    await plan.locator("summary").click();
    assert.equal(await plan.locator("tbody tr").count(), 5);
    assert.doesNotMatch((await plan.textContent()) ?? "", /–/);
  });
});
