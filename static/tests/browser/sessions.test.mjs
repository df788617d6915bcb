// The list of walks in a real browser against the mock: narrowed, ordered, paged, its address sent on; notes.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("the list of walks", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock({ stepMs: 500 });
    for (let i = 0; i < 60; i++)
      mock.walks.set(`old${i}`, {
        ...mock.walks.get("s8"),
        id: `old${i}`,
        title: `Old ${i}`,
        started_at: new Date(Date.UTC(2026, 0, 1 + i, 4)).toISOString(),
        anomalies: i % 20 === 0 ? 3 : 0,
      });
    tab = await openPage(mock.url);
    await tab.page.goto(`${mock.url}/#/sessions`);
    await tab.page.getByTestId("session-card").first().waitFor();
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  const cards = () => tab.page.getByTestId("session-card");

  test("words narrow it, pages divide it, and it tells how much is stored", async () => {
    const { page } = tab;
    await becomes(() => cards().count(), 50);
    await page.getByText("66 walks").waitFor();
    await page.getByRole("button", { name: "Next" }).click();
    await becomes(() => cards().count(), 16);
    await page.waitForFunction(() => location.hash.includes("page=2"));
    await page.locator("[name=text]").fill("spiral");
    await becomes(() => cards().count(), 1);
    await page.waitForFunction(() => location.hash === "#/sessions?text=spiral");
  });

  test("days, flags and order stand in the address, which leads back to the same list", async () => {
    const { page } = tab;
    await page.goto("about:blank");
    await page.goto(`${mock.url}/#/sessions?from=2026-01-01&to=2026-01-21&flags=anomalies&sort=-started`);
    await becomes(() => cards().count(), 2);
    await becomes(() => cards().locator("b").first().textContent(), "Old 0");
    assert.equal(await page.getByLabel("anomalies").isChecked(), true);
    await cards().first().getByText("3 anomalies").waitFor();
    await page.locator("[name=sort]").selectOption("started");
    await becomes(() => cards().locator("b").first().textContent(), "Old 20");
    await page.getByRole("button", { name: "Clear" }).click();
    await becomes(() => cards().count(), 50);
    await page.waitForFunction(() => location.hash === "#/sessions");
  });

  test("a walk is marked and noted, and the list shows it", async () => {
    const { page } = tab;
    await page.goto(`${mock.url}/#/sessions/s9`);
    const note = page.getByTestId("note");
    await note.locator("[name=note]").fill("look at <b>this</b>");
    await note.getByRole("button", { name: "Star this walk" }).click();
    await page.getByRole("button", { name: "Star this walk", pressed: true }).waitFor();
    await page.goto(`${mock.url}/#/sessions?flags=starred`);
    await becomes(() => cards().count(), 1);
    await cards().getByText("look at <b>this</b>").waitFor();
  });

  test("nothing went wrong", () => assert.deepEqual(tab.wrongs, []));
});
