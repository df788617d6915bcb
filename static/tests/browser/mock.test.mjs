// The page in a real browser, against the mock server, which can be told to misbehave.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;
const LOG = `t_s,gyr_x_rad_s,gyr_y_rad_s\n${"0.01,0.1,0.2\n".repeat(700_000)}`;

describe("the page", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock({ stepMs: 100 });
    tab = await openPage(mock.url);
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  // Every test begins on a page that has just been opened, so that one that fails takes no other with it.
  beforeEach(async () => {
    mock.site.muted.clear();
    Object.assign(mock.orders, { dropAfterBytes: Infinity, refused: false });
    await tab.page.goto("about:blank");
    await visit("#/live");
    await row("i1").waitFor();
  });
  const visit = async (/** @type {string} */ hash) => {
    await tab.page.goto(`${mock.url}/${hash}`);
    await tab.page.locator("html[data-ready=yes]").waitFor();
  };
  const part = (/** @type {string} */ name) => tab.page.getByRole("tab", { name }).click();
  const row = (/** @type {string} */ id) => tab.page.locator(`[data-inspector="${id}"]`);

  test("shows everybody and moves their rows", async () => {
    await becomes(() => tab.page.locator("[data-testid=inspector-row]").count(), 5);
    await becomes(() => tab.page.locator("[data-testid=map-person]").count(), 4);
    const east = await row("i1").getAttribute("data-east-m");
    await tab.page.waitForFunction(
      (was) => document.querySelector('[data-inspector="i1"]')?.getAttribute("data-east-m") !== was,
      east,
    );
  });

  test("a click on a row opens the details, Escape closes them", async () => {
    await row("i1").click();
    const drawer = tab.page.getByTestId("drawer");
    await drawer.getByText("Chen Wei").waitFor();
    await becomes(() => drawer.locator(".candidate:visible").count(), 5);
    await tab.page.keyboard.press("Escape");
    await drawer.waitFor({ state: "hidden" });
  });

  test("the search narrows the list until Escape; letters typed there are no shortcuts", async () => {
    await tab.page.keyboard.press("/");
    await tab.page.keyboard.type("oka");
    await becomes(() => tab.page.locator("[data-testid=inspector-row]:visible").count(), 1);
    await tab.page.keyboard.press("Escape");
    await becomes(() => tab.page.locator("[data-testid=inspector-row]:visible").count(), 5);
  });

  test("somebody whose data stop becomes silent, on the client's own clock", async () => {
    mock.site.muted.add("i2");
    await tab.page.locator('[data-inspector="i2"][data-presence="silent"]').waitFor();
    await becomes(() => tab.page.locator("[data-testid=inspector-row]").first().getAttribute("data-inspector"), "i2");
  });

  test("a lost link is told with the age of the data, and mends itself", async () => {
    mock.orders.refused = true;
    mock.cut();
    const banner = tab.page.getByTestId("banner");
    await banner.getByText(/Data as of \d\d:\d\d:\d\d UTC\+8/).waitFor();
    mock.orders.refused = false;
    await banner.waitFor({ state: "hidden" });
    const north = await row("i1").getAttribute("data-north-m");
    await tab.page.waitForFunction(
      (was) => document.querySelector('[data-inspector="i1"]')?.getAttribute("data-north-m") !== was,
      north,
    );
    // A refused socket is an error in the browser's console; that one was ordered.
    const rest = tab.wrongs.filter((w) => !w.includes("WebSocket"));
    tab.wrongs.length = 0;
    tab.wrongs.push(...rest);
  });

  test("a finished walk is drawn with and without markers", async () => {
    await visit("#/sessions");
    await tab.page.getByText("Spiral, evening").click();
    await tab.page.locator("[data-testid=session][data-drawn=yes]").waitFor();
    await part("Markers");
    await becomes(() => tab.page.getByTestId("visits").locator("tbody tr:not(.reason)").count(), 9);
    await tab.page.locator("#legend").getByText("without markers").waitFor();
    await tab.page
      .getByTestId("figures")
      .filter({ hasText: /1440 m.*8 \/ 9/s })
      .waitFor();
    await part("Quality");
    const aids = tab.page.getByTestId("aids").locator("tbody tr");
    await becomes(() => aids.count(), 3);
    await aids.filter({ hasText: "Separation of the feet" }).getByText("overconfident").waitFor();
    await aids.filter({ hasText: "Magnetic heading" }).getByText("49", { exact: true }).waitFor();
    await tab.page.getByTestId("health").filter({ hasText: "100 / 100 Hz" }).waitFor();
    await tab.page.getByTestId("residuals").getByText("passed").waitFor();
    await becomes(() => tab.page.getByTestId("histogram").locator("rect").count(), 14);
  });

  test("a walk is replayed: keys, a click on the track, a stretch again and again, and an address that leads back", async () => {
    await visit("#/sessions/s9?t=100");
    const { page } = tab;
    const time = page.locator("[data-figure=time]");
    await page.locator("[data-testid=session][data-charted=yes][data-compared=yes]").waitFor();
    await becomes(() => time.textContent(), "1:40.0");
    await page.keyboard.press("ArrowRight");
    await becomes(() => time.textContent(), "1:40.1");
    await page.keyboard.press("Shift+ArrowLeft");
    await becomes(() => time.textContent(), "1:39.1");
    await page.keyboard.press("Alt+ArrowRight");
    await becomes(() => time.textContent(), "2:07.5");
    await becomes(
      () => page.locator("[data-figure=marker]").textContent(),
      `${await page.locator("[data-visit]").first().textContent()} · 0 s`,
    );
    await page.keyboard.press("End");
    await becomes(() => time.textContent(), "20:00.0");
    await page.keyboard.press("Home");
    await becomes(() => time.textContent(), "0:00.0");
    for (let k = 0; k < 6; k++) await page.keyboard.press("]");
    await becomes(() => page.getByTestId("speed").inputValue(), "64");
    await page.keyboard.press(" ");
    await page.waitForFunction(
      () => Number(document.querySelector("[data-testid=time-bar]")?.getAttribute("aria-valuenow")) > 20,
    );
    await page.keyboard.press(" ");
    await becomes(() => page.locator(".dock").getAttribute("data-state"), "paused");
    // From A to B, over and over.
    await page.keyboard.press("Home");
    await page.keyboard.press("a");
    await page.keyboard.press("Alt+ArrowRight");
    await page.keyboard.press("b");
    await page.keyboard.press(" ");
    const wrapped = await page.evaluate(
      () =>
        new Promise((/** @type {(times: number[]) => void} */ resolve) => {
          const bar = document.querySelector("[data-testid=time-bar]");
          /** @type {number[]} */
          const times = [];
          const look = () => {
            times.push(Number(bar?.getAttribute("aria-valuenow")));
            if (times.length > 2 && times[times.length - 1] < times[times.length - 2]) resolve(times);
            else requestAnimationFrame(look);
          };
          look();
        }),
    );
    assert.ok(
      wrapped.every((t_s) => t_s <= 127.5),
      String(wrapped),
    );
    await page.keyboard.press(" ");
    await page.getByRole("button", { name: "No repeat" }).click();
    await page.keyboard.press("Home");
    const position = await page.evaluate(async () => {
      const main = "/js/main.js";
      const { app } = await import(main);
      const points = app.runs.lines.at(-1).points;
      const [e, n] = points[points.length - 400];
      const at = app.stage.map.latLngToContainerPoint([n, e]);
      return { x: at.x, y: at.y };
    });
    await page.getByTestId("map").click({ position });
    await page.waitForFunction(
      () => Number(document.querySelector("[data-testid=time-bar]")?.getAttribute("aria-valuenow")) > 900,
    );
    await page.waitForFunction(() => /t=9\d\d|t=1\d\d\d/.test(location.hash));
    // Other aids, and another walk on the same time bar.
    await page.getByText("Compute with other measurements").click();
    await page.getByRole("button", { name: "Zero velocity only" }).click();
    await page.locator("#legend").getByText("Zero velocity", { exact: true }).waitFor();
    await page.locator("select[name=beside]").focus();
    await page.locator("select[name=beside] option").nth(1).waitFor({ state: "attached" });
    await page.locator("select[name=beside]").selectOption("s8");
    await page.locator("#legend").getByText("Second team").waitFor();
    await page.waitForFunction(() => location.hash.includes("with=s8") && location.hash.includes("aids:zupt"));
    await page.reload();
    await page.locator("#legend").getByText("Second team").waitFor();
    await page.locator("#legend").getByText("Zero velocity", { exact: true }).waitFor();
    // Every chart that there is can be shown.
    const hidden = page.locator("[data-group][aria-pressed=false]");
    while ((await hidden.count()) > 0) await hidden.first().click();
    await becomes(() => page.locator(".plot:visible").count(), 22);
  });

  test("the details say where somebody stood last", async () => {
    await row("i3").click();
    const stand = tab.page.getByTestId("drawer").getByTestId("stand");
    await becomes(() => stand.locator(".candidate:visible").count(), 3);
    await stand.getByRole("button", { name: "Accept A58" }).waitFor();
  });

  test("a stand's marker is accepted and taken back", async () => {
    await visit("#/sessions/s9");
    await part("Markers");
    const stand = tab.page.locator('[data-stand="3"]');
    await stand.getByText("62 %").waitFor();
    await stand.getByText("none of these").waitFor();
    await stand.getByRole("button", { name: "Accept A17" }).click();
    await stand.getByText("selected").waitFor();
    await stand.getByRole("button", { name: "Undo" }).click();
    await stand.getByText("selected").waitFor({ state: "detached" });
    // What somebody keyed in is not chosen again.
    await tab.page.locator('[data-stand="1"]').getByText("keyed in").waitFor();
    await becomes(() => tab.page.locator('[data-stand="1"] [data-choose]:enabled').count(), 0);
  });

  test("both feet are handed in through a lost answer; the track is worked out and linked", async () => {
    await visit("#/upload");
    mock.orders.dropAfterBytes = 5_000_000;
    await tab.page.getByTestId("files").setInputFiles([
      { name: "walk-right.csv", mimeType: "text/csv", buffer: Buffer.from(LOG.slice(0, 50_000)) },
      { name: "walk-left.csv", mimeType: "text/csv", buffer: Buffer.from(LOG) },
    ]);
    await tab.page.getByTestId("foot-left").getByText("walk-left.csv").waitFor();
    await tab.page.locator("input[name=marker]").fill("a17");
    await tab.page.getByRole("button", { name: "Upload" }).click();
    await tab.page.getByText("Select the inspector whose walk this is.").waitFor();
    await tab.page.locator("select[name=inspector]").selectOption({ label: "Chen Wei" });
    await tab.page.getByRole("button", { name: "Upload" }).click();
    await tab.page.getByTestId("upload-done").getByText("Upload complete.").waitFor();
    // The cut was ordered; a browser that repeats the piece by itself is told the right offset (409).
    tab.wrongs.splice(
      0,
      tab.wrongs.length,
      ...tab.wrongs.filter((w) => !/ERR_EMPTY_RESPONSE|ERR_CONNECTION_RESET|409/.test(w)),
    );
    // The next walk is another one.
    for (const name of ["inspector", "marker"])
      await becomes(() => tab.page.locator(`[name=${name}]`).inputValue(), "");
    await tab.page.getByText("Open the track").click();
    await tab.page.locator("[data-testid=session][data-drawn=yes]").waitFor();
  });

  test("what the server refuses is said in its words, with the place", async () => {
    await visit("#/upload");
    await tab.page
      .getByTestId("files")
      .setInputFiles([{ name: "left.csv", mimeType: "text/csv", buffer: Buffer.from("a,b\n1,2\n") }]);
    await tab.page.locator("input[name=marker]").fill("A17");
    await tab.page.locator("select[name=inspector]").selectOption({ label: "Chen Wei" });
    await tab.page.getByRole("button", { name: "Upload" }).click();
    const problem = tab.page.getByTestId("problem");
    await problem.getByText("expected the column gyr_x_rad_s").waitFor();
    await problem.getByText("line 1").waitFor();
    // The refusal itself shows in the browser's console.
    tab.wrongs.splice(0, tab.wrongs.length, ...tab.wrongs.filter((w) => !w.includes("422")));
    // The walk that was begun for it is gone with it.
    await tab.page.reload();
    await tab.page.getByTestId("drop").waitFor();
    assert.equal(await tab.page.getByTestId("unfinished").count(), 0);
  });

  test("the language changes in place, and is kept", async () => {
    await tab.page.locator("#language").click();
    await tab.page.getByRole("link", { name: "实时" }).waitFor();
    await tab.page.reload();
    await tab.page.getByRole("link", { name: "巡检记录" }).waitFor();
    await becomes(() => tab.page.locator("html").getAttribute("lang"), "zh-CN");
    await tab.page.locator("#language").click();
  });

  test("nothing went wrong: no error, no report of the policy, no request to another host", () => {
    assert.deepEqual(tab.wrongs, []);
  });
});
