// The page on a running demo: `LODESTEP_URL=http://127.0.0.1:8080 npm run test:browser`. Opens it, blocks every
// other host, and sees an inspector move.

import assert from "node:assert/strict";
import { test } from "node:test";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const url = process.env.LODESTEP_URL;
const skip = !url ? "set LODESTEP_URL to a running demo" : (await findChrome()) ? false : HOW_TO_GET_CHROME;

test(
  "an inspector moves on the demo's page, which asks no other host for anything",
  { skip, timeout: 120_000 },
  async () => {
    const tab = await openPage(String(url));
    try {
      const { page } = tab;
      const answer = await page.goto(`${url}/#/live`);
      assert.equal(answer?.status(), 200);
      await page.locator("html[data-ready=yes]").waitFor();
      const walking = page.locator("[data-testid=inspector-row][data-east-m]");
      await walking.first().waitFor({ timeout: 60_000 });
      await page.getByTestId("map-person").first().waitFor({ state: "attached" });
      const places = () =>
        page.evaluate(() =>
          [...document.querySelectorAll("[data-inspector][data-east-m]")].map((row) => [
            row.getAttribute("data-inspector"),
            Number(row.getAttribute("data-east-m")),
            Number(row.getAttribute("data-north-m")),
          ]),
        );
      const before = await places();
      await page.waitForFunction(
        (was) =>
          [...document.querySelectorAll("[data-inspector][data-east-m]")].some((row) => {
            const old = was.find((w) => w[0] === row.getAttribute("data-inspector"));
            return (
              old &&
              Math.hypot(
                Number(row.getAttribute("data-east-m")) - Number(old[1]),
                Number(row.getAttribute("data-north-m")) - Number(old[2]),
              ) > 1
            );
          }),
        before,
        { timeout: 60_000 },
      );
      await page.goto(`${url}/#/sessions`);
      await page.getByTestId("session-card").first().waitFor();
      const finished = page.locator("[data-testid=session-card][data-state=finished]");
      if ((await finished.count()) > 0) {
        await finished.first().click();
        await page.locator("[data-testid=session][data-drawn=yes]").waitFor();
      }
      assert.deepEqual(tab.wrongs, []);
    } finally {
      await tab.close();
    }
  },
);

test(
  "the first account is made on the demo, its owner signs out and in again, and the walks go on",
  { skip, timeout: 120_000 },
  async (context) => {
    const token = process.env.LODESTEP_SETUP_TOKEN;
    if (!token) return context.skip("set LODESTEP_SETUP_TOKEN to the demo's");
    const tab = await openPage(String(url));
    try {
      const { page } = tab;
      await page.goto(`${url}/#/account`);
      const form = page.getByTestId("set-up");
      await form.locator("[name=setup_token]").fill(token);
      await form.locator("[name=name]").fill("Wang Fang");
      await form.locator("[name=password]").fill("a sentence nobody says");
      await form.getByRole("button").click();
      await page.getByRole("heading", { name: "Wang Fang" }).waitFor();
      // The browser keeps the cookie, over plain HTTP on the machine itself, too.
      const [cookie] = await page.context().cookies();
      assert.deepEqual(
        [cookie.name, cookie.httpOnly, cookie.secure, cookie.sameSite],
        ["__Host-lodestep", true, true, "Strict"],
      );
      await page.getByRole("button", { name: "Sign out" }).first().click();
      const door = page.getByTestId("door");
      await door.locator("[name=name]").fill("wang fang");
      await door.locator("[name=password]").fill("a sentence nobody says");
      await page.keyboard.press("Enter");
      await page.getByRole("heading", { name: "Wang Fang" }).waitFor();
      await page.goto(`${url}/#/live`);
      await page.locator("[data-testid=inspector-row][data-east-m]").first().waitFor({ timeout: 60_000 });
      await page.goto(`${url}/#/admin/audit`);
      await page.getByTestId("audit").getByText("added an account").first().waitFor();
      assert.deepEqual(
        tab.wrongs.filter((w) => !w.includes("401")),
        [],
      );
    } finally {
      await tab.close();
    }
  },
);
