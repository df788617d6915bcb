// The laboratory in a real browser against the mock: parameters turned and kept, walks worked out, runs compared and replayed.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("the laboratory", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;
  /** What the page asked. @type {string[]} */
  const asked = [];
  let leaves = true;

  before(async () => {
    mock = await startMock({ stepMs: 500 });
    tab = await openPage(mock.url);
    tab.page.on("dialog", (dialog) => {
      asked.push(dialog.message());
      return leaves ? dialog.accept() : dialog.dismiss();
    });
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  const row = (/** @type {string} */ key) => tab.page.locator(`[data-parameter="${key}"]`);
  const set = async (/** @type {string} */ key, /** @type {string} */ value) => {
    await row(key).locator("input").fill(value);
    await row(key).locator("input").blur();
  };

  test("a name is typed right after a value, and who leaves unsaved values is asked", async () => {
    const { page } = tab;
    await page.goto(`${mock.url}/#/lab`);
    await page.getByTestId("parameters").waitFor();
    await row("marker_sigma_m").locator("input").fill("0.3");
    // The value is taken when its field is left, which is by this click.
    await page.locator(".new-set [name=name]").click();
    await page.keyboard.type("bold");
    await page.locator('tr.changed[data-parameter="marker_sigma_m"]').waitFor();
    assert.equal(await page.locator(".new-set [name=name]").inputValue(), "bold");
    leaves = false;
    await page.getByRole("link", { name: "Live" }).click();
    await becomes(() => Promise.resolve(asked.at(-1)), "There are edits that were not saved. Leave them?");
    await becomes(() => Promise.resolve(new URL(page.url()).hash), "#/lab");
    assert.equal(await row("marker_sigma_m").locator("input").inputValue(), "0.3");
    leaves = true;
    await page.getByRole("link", { name: "Live" }).click();
    await page.getByTestId("people").waitFor();
  });

  test("a parameter is turned within its range, marked, kept under a name, and put back", async () => {
    const { page } = tab;
    await page.goto(`${mock.url}/#/live`);
    await page.locator("html[data-ready=yes]").waitFor();
    await page.getByRole("link", { name: "Laboratory" }).click();
    await page.getByTestId("parameters").waitFor();
    await page.getByText("How far from a marker an inspector stands").waitFor();
    await set("marker_sigma_m", "99");
    await row("marker_sigma_m").getByText("expected a number from 0.01 to 20 m").waitFor();
    await set("marker_sigma_m", "0.25");
    await page.locator('tr.changed[data-parameter="marker_sigma_m"]').waitFor();
    await set("stance.threshold", "12");
    await page.getByText("2 parameters differ from the default").waitFor();
    await row("stance.threshold").getByRole("button").click();
    await page.getByText("1 parameter differs from the default").waitFor();
    await page.locator(".new-set [name=name]").fill("<b>firm</b>");
    await page.locator(".new-set [name=about]").fill("markers are believed");
    await page.getByRole("button", { name: "Save as new set" }).click();
    await page.locator("[name=set] option", { hasText: "<b>firm</b>" }).waitFor({ state: "attached" });
    assert.deepEqual(mock.lab.sets[0].parameters, { marker_sigma_m: 0.25 });
    await set("marker_sigma_m", "0.5");
    await page.getByText("not saved").waitFor();
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await becomes(() => Promise.resolve(mock.lab.sets[0].version), 2);
    await page.locator("[name=set]").selectOption("");
    await becomes(() => row("marker_sigma_m").locator("input").inputValue(), "1");
    await page.locator("[name=set]").selectOption("p1");
    await becomes(() => row("marker_sigma_m").locator("input").inputValue(), "0.5");
  });

  test("a set is made the site's, which is told with its version, and the defaults are taken again", async () => {
    const { page } = tab;
    const site = page.getByTestId("site-parameters");
    await site.getByText("computed with the defaults").waitFor();
    await site.getByRole("button", { name: "Make this set the site’s" }).click();
    await site.getByText("with the set “<b>firm</b>”, version 2").waitFor();
    await site.getByText("marker_sigma_m = 0.5").waitFor();
    assert.equal(mock.lab.site.set.version, 2);
    assert.equal(await site.getByRole("button", { name: "Make this set the site’s" }).isDisabled(), true);
    // The set goes on; the site's stays what it was.
    await set("marker_sigma_m", "0.4");
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await site.getByText("since been changed, to version 3").waitFor();
    assert.deepEqual(mock.lab.site.parameters, { marker_sigma_m: 0.5 });
    await set("marker_sigma_m", "0.5");
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await site.getByRole("button", { name: "Back to the defaults" }).click();
    await site.getByText("computed with the defaults").waitFor();
    assert.equal(mock.lab.site.set, null);
  });

  test("walks are worked out with it, and compared with their own tracks", async () => {
    const { page } = tab;
    await page.getByLabel("Spiral, evening").check();
    await page.getByLabel("Second team").check();
    await page.getByText("2 selected").waitFor();
    await page.getByRole("button", { name: "Run" }).click();
    await page.getByTestId("under-way").getByText("2 running").waitFor();
    await page.getByTestId("under-way").getByText("2 running").waitFor({ state: "detached" });
    const run = page
      .getByTestId("comparison")
      .locator('[data-walk="s9"] [data-run="r1"], [data-walk="s9"] [data-run="r2"]');
    await run.getByText("<b>firm</b>").waitFor();
    // A smaller closure is better, larger marker residuals are worse, a NIS nearer to 1 is better; time is neither.
    const tones = () => run.locator("td.num small").evaluateAll((cells) => cells.map((cell) => cell.className));
    await becomes(async () => (await tones()).join(" "), "good bad good muted");
    const all = page.getByTestId("over-all").locator("tbody tr");
    await becomes(() => all.count(), 1);
    await all.getByText("better on 2 of 2").first().waitFor();
    await run.getByText("Provenance").click();
    await run.getByText("marker_sigma_m = 0.5").waitFor();
    assert.equal(
      await page.getByRole("link", { name: "As CSV" }).getAttribute("href"),
      "/api/v1/lab/comparison.csv?session_ids=s9,s8",
    );
    await page.reload();
    await run.waitFor();
  });

  test("a run is laid over the walk's own track in the replay, and removed", async () => {
    const { page } = tab;
    await page.locator('[data-walk="s9"]').getByRole("link", { name: "Replay" }).click();
    await page.locator("[data-testid=session][data-compared=yes]").waitFor();
    await page.locator("#legend").getByText("<b>firm</b>").waitFor();
    await page.waitForFunction(() => /run=main,lab:r\d/.test(location.hash));
    await page.goto(`${mock.url}/#/lab?walks=s9`);
    await page.locator("[data-remove-run]").click();
    await page.locator("[data-remove-run]").waitFor({ state: "detached" });
    assert.equal(mock.lab.runs.length, 1);
  });

  test("who may not turn parameters looks on", async () => {
    const { page } = tab;
    mock.staff.close();
    mock.staff.accounts[0].role = "viewer";
    await page.goto("about:blank");
    await page.goto(`${mock.url}/#/lab?walks=s8`);
    await page.locator("[data-testid=door] [name=name]").fill("Chen Wei");
    await page.locator("[data-testid=door] [name=password]").fill("a good sentence");
    await page.keyboard.press("Enter");
    await page.getByTestId("comparison").waitFor();
    assert.equal(await page.getByRole("button", { name: "Run" }).count(), 0);
    assert.equal(await row("marker_sigma_m").locator("input").isDisabled(), true);
    await page.getByRole("link", { name: "Laboratory" }).waitFor({ state: "hidden" });
  });

  test("nothing went wrong", () =>
    assert.deepEqual(
      tab.wrongs.filter((w) => !w.includes("401")),
      [],
    ));
});
