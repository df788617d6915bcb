// Markers on a real server: edited by two people, imported from a file, taken back, and taken out and in again.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, beforeEach, describe, test } from "node:test";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, signInAt, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;
const PASSWORD = "a sentence nobody says";

describe("markers, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {ReturnType<typeof real.as>} */
  let owner;
  /** @type {Record<string, Awaited<ReturnType<typeof openPage>>>} */
  const tabs = {};

  before(async () => {
    real = await startReal();
    const { nodes } = await real.get("/site/plan");
    const csv = `name,e_m,n_m,u_m\n${nodes.map((/** @type {any} */ m) => `${m.name},${m.e_m},${m.n_m},${m.u_m}`).join("\n")}\n`;
    await real.post("/markers/import", csv, { "Content-Type": "text/csv" });
    owner = await real.setUp("Wang Fang", PASSWORD);
    for (const name of ["Zhang Min", "李娜"]) {
      await owner.post("/accounts", { name, password: PASSWORD, role: "surveyor" });
      tabs[name] = await openPage(real.url);
      await tabs[name].page.goto(`${real.url}/#/markers`);
      await tabs[name].page.getByTestId("door").waitFor();
      await signInAt(tabs[name].page, name, PASSWORD);
      tabs[name].wrongs.length = 0;
    }
  });
  after(async () => {
    for (const tab of Object.values(tabs)) await tab.close();
    await real?.stop();
  });
  beforeEach(async () => {
    for (const { page } of Object.values(tabs)) {
      await page.goto("about:blank");
      await page.goto(`${real.url}/#/markers`);
      await page.locator("[data-testid=markers] tbody tr").first().waitFor();
    }
  });

  /** @param {string} who @param {string} name */
  const edit = async (who, name) => {
    const { page } = tabs[who];
    await page.locator("#side input[type=search]").fill(name);
    await page.locator(`[data-marker="${name}"]`).click();
    await page.locator("[data-do=edit]").click();
    return page;
  };
  /** @param {string} name @returns {Promise<any>} */
  const now = (name) => owner.get(`/markers/${name}`);

  test("an edit takes a reason, and its history says who, when and why", async () => {
    const page = await edit("Zhang Min", "B20");
    await page.locator("#drawer [name=u_m]").fill("12.345");
    await page.locator("#drawer [name=reason]").fill("levelled again");
    await page.getByTestId("save-marker").click();
    const history = page.getByTestId("history");
    await history.getByText("levelled again").waitFor();
    await history.getByText("Zhang Min").waitFor();
    assert.equal((await now("B20")).u_m, 12.345);
    const [entry] = await owner.get("/audit?subject=B20&limit=1");
    assert.deepEqual([entry.who, entry.after.u_m], ["Zhang Min", 12.345]);
    // Somebody else sees it without asking.
    await tabs["李娜"].page.locator("#side input[type=search]").fill("B20");
    await tabs["李娜"].page.locator("[data-testid=markers]").getByText("12.345").waitFor();
  });

  test("who saves second is shown what stands now, and decides", async () => {
    const mine = await edit("Zhang Min", "B40");
    const theirs = await edit("李娜", "B40");
    await theirs.locator("#drawer [name=e_m]").fill("49");
    await theirs.locator("#drawer [name=reason]").fill("theirs");
    await mine.locator("#drawer [name=e_m]").fill("50.5");
    await mine.locator("#drawer [name=reason]").fill("mine");
    await theirs.getByTestId("save-marker").click();
    await theirs.getByTestId("history").getByText("theirs").waitFor();
    await mine.getByTestId("save-marker").click();
    const conflict = mine.getByTestId("conflict");
    await conflict.getByText("49.000").waitFor();
    await conflict.getByText("50.500").waitFor();
    assert.equal((await now("B40")).e_m, 49, "nothing is overwritten in silence");
    await conflict.getByRole("button", { name: "Use mine" }).click();
    await mine.getByTestId("history").getByText("mine").waitFor();
    assert.equal((await now("B40")).e_m, 50.5);
    assert.deepEqual(
      (await owner.get("/markers/B40/history")).slice(0, 2).map((/** @type {any} */ c) => [c.changed_by, c.reason]),
      [
        ["Zhang Min", "mine"],
        ["李娜", "theirs"],
      ],
    );
    const rest = tabs["Zhang Min"].wrongs.filter((w) => !w.includes("409"));
    tabs["Zhang Min"].wrongs.splice(0, Infinity, ...rest);
  });

  test("a file with east and north changed over is found out, put right, applied and taken back", async () => {
    const { page } = tabs["Zhang Min"];
    const some = await Promise.all(["D10", "D11", "D12", "D13", "D14", "D15", "D16", "D17"].map(now));
    const rows = some.map((m, i) => `${m.name},${m.n_m},${m.e_m + (i === 0 ? 0.25 : 0)},${m.u_m}`);
    await page.getByTestId("import-markers").click();
    await page.getByTestId("markers-file").setInputFiles({
      name: "survey.csv",
      mimeType: "text/csv",
      buffer: Buffer.from(`name,e_m,n_m,u_m\n${rows.join("\n")}\n`),
    });
    const findings = page.getByTestId("findings");
    await findings.getByText("all: east and north swapped").waitFor();
    await findings.getByRole("button", { name: "Swap columns" }).click();
    const difference = page.getByTestId("difference");
    await difference.getByRole("button", { name: "1 changed" }).waitFor();
    await difference.getByRole("button", { name: "7 unchanged" }).waitFor();
    await difference.getByText("0.250").waitFor();
    await page.getByTestId("wizard").locator("form.apply [name=reason]").fill("autumn survey");
    const sure = page.locator("[name=accept]");
    if ((await sure.count()) > 0) await sure.check();
    await page.getByTestId("apply-import").click();
    await page.getByText("survey.csv: 0 added, 1 changed, 0 removed, 7 unchanged.").waitFor();
    assert.ok(Math.abs((await now("D10")).e_m - some[0].e_m - 0.25) < 1e-9);
    const applied = page.locator("[data-testid=import-row][data-state=applied]").filter({ hasText: "survey.csv" });
    await applied.getByText("Zhang Min").waitFor();
    await applied.getByRole("button", { name: "Revert" }).click();
    await page.locator("form.revert [name=reason]").fill("wrong station");
    await page.getByTestId("revert-import").click();
    await page.locator("[data-testid=import-row][data-state=reverted]").filter({ hasText: "survey.csv" }).waitFor();
    assert.equal((await now("D10")).e_m, some[0].e_m);
  });

  test("what somebody has changed since stays, unless it is said that the others alone go back", async () => {
    const { page } = tabs["Zhang Min"];
    const [a, b] = await Promise.all(["E10", "E11"].map(now));
    await page.getByTestId("import-markers").click();
    await page.getByTestId("markers-file").setInputFiles({
      name: "two.csv",
      mimeType: "text/csv",
      buffer: Buffer.from(
        `name,e_m,n_m,u_m\nE10,${a.e_m + 0.1},${a.n_m},${a.u_m}\nE11,${b.e_m + 0.1},${b.n_m},${b.u_m}\n`,
      ),
    });
    await page.getByTestId("difference").getByRole("button", { name: "2 changed" }).waitFor();
    await page.getByTestId("wizard").locator("form.apply [name=reason]").fill("two of them");
    await page.getByTestId("apply-import").click();
    await page.getByText("two.csv: 0 added, 2 changed").waitFor();
    await owner.put("/markers/E11", { e_m: 1, n_m: 2, u_m: 3, reason: "moved since", force: true });
    await page
      .locator("[data-testid=import-row][data-state=applied]")
      .filter({ hasText: "two.csv" })
      .getByRole("button", { name: "Revert" })
      .click();
    await page.locator("form.revert [name=reason]").fill("not these");
    await page.getByTestId("revert-import").click();
    await page.locator(".wizard .answer").getByText("E11", { exact: true }).waitFor();
    await page.locator("[data-step=skip]").click();
    await page.locator("[data-testid=import-row][data-state=reverted]").filter({ hasText: "two.csv" }).waitFor();
    assert.deepEqual([(await now("E10")).e_m, (await now("E11")).e_m], [a.e_m, 1]);
    tabs["Zhang Min"].wrongs.splice(0, Infinity, ...tabs["Zhang Min"].wrongs.filter((w) => !w.includes("409")));
  });

  test("what is taken out comes in again unchanged", async () => {
    const { page } = tabs["Zhang Min"];
    const [download] = await Promise.all([
      page.waitForEvent("download"),
      page.locator("a[download]", { hasText: "Export" }).click(),
    ]);
    const csv = await readFile(await download.path());
    await page.getByTestId("import-markers").click();
    await page.getByTestId("markers-file").setInputFiles({ name: "export.csv", mimeType: "text/csv", buffer: csv });
    const all = (await owner.get("/markers")).length;
    await page
      .getByTestId("difference")
      .getByRole("button", { name: `${all} unchanged` })
      .waitFor();
    await becomes(() => page.getByTestId("apply-import").isDisabled(), true);
  });

  test("nothing went wrong", () => {
    for (const { wrongs } of Object.values(tabs)) assert.deepEqual(wrongs, []);
  });
});
