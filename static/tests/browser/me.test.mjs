// The inspector's page on a small screen: with a link, without one, and over a reload without one.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("the inspector's page", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock({ stepMs: 200 });
    tab = await openPage(mock.url, { viewport: { width: 390, height: 844 }, hasTouch: true });
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  beforeEach(async () => {
    Object.assign(mock.orders, { refused: false, loseVisitAnswer: false, farMarker: "" });
    await tab.context.setOffline(false);
    await tab.page.goto("about:blank");
    await open();
    await tab.page.evaluate(() => localStorage.clear());
    await tab.page.reload();
    await tab.page.getByTestId("me").waitFor();
  });
  const open = async () => {
    await tab.page.goto(`${mock.url}/#/me`);
    await tab.page.getByTestId("me").waitFor();
  };
  const choose = async (/** @type {string} */ name) => {
    await tab.page.locator("select[name=who] option", { hasText: name }).waitFor({ state: "attached" });
    await tab.page.getByTestId("me-who").selectOption({ label: name });
  };
  const press = async (/** @type {string} */ keys) => {
    for (const key of keys) await tab.page.locator(`[data-key="${key}"]`).click();
  };
  const keyed = () => tab.page.getByTestId("me-keyed").locator("li");
  const allSent = () => tab.page.getByText("Everything has been sent.").waitFor();

  test("whose sensors are live keys in an actuator in three taps, and takes it back", async () => {
    await choose("Chen Wei");
    await tab.page.getByText("Your sensors are live").waitFor();
    await tab.page.getByTestId("me-chips").locator("button").first().click();
    await tab.page.getByTestId("me-enter").click();
    await keyed().first().getByText("accepted").waitFor();
    await keyed().first().getByRole("button", { name: /Undo/ }).click();
    await keyed().first().getByText("undone").waitFor();
    await allSent();
  });

  test("what the track contradicts is asked for twice, and what the gate turns down is said", async () => {
    await choose("Chen Wei");
    mock.orders.farMarker = "C120";
    await press("C120");
    await tab.page.getByText(/You appear to be .* away/).waitFor();
    await tab.page.getByTestId("me-enter").click();
    assert.equal(await keyed().count(), 0);
    await tab.page.getByRole("button", { name: "Enter anyway" }).click();
    await tab.page.getByText(/you were not at C120: expected within 4.1 m/).waitFor();
  });

  test("a name that is not on the site cannot be entered; the keyboard is a pad, too", async () => {
    await choose("Chen Wei");
    await tab.page.getByTestId("me-typed").click();
    await tab.page.keyboard.type("a9999");
    await tab.page.getByText("There is no A9999 on this site.").waitFor();
    assert.ok(await tab.page.getByTestId("me-enter").isDisabled());
    for (let i = 0; i < 3; i++) await tab.page.keyboard.press("Backspace");
    await becomes(() => tab.page.getByTestId("me-typed").textContent(), "A9");
  });

  test("a walk is begun, walked and ended without a link; all of it is handed over once, over a reload", async () => {
    await choose("Novak, Petr");
    await tab.page.getByText("This page also opens without a connection.").waitFor();
    // Every file that the page is made of has been kept once it was loaded.
    await tab.page.waitForFunction(async () => (await (await caches.open("lodestep")).keys()).length > 40);
    await tab.context.setOffline(true);
    mock.cut();
    await press("A17");
    await tab.page.getByRole("button", { name: "Start a walk" }).click();
    await tab.page.getByText("Walking for").waitFor();
    await press("A17");
    await tab.page.getByTestId("me-enter").click();
    await keyed().first().getByText("waiting for connection").waitFor();
    await tab.page.getByTestId("me-fault").locator("summary").click();
    await tab.page.getByTestId("me-fault").getByText("high").click();
    await tab.page.getByTestId("me-fault").locator("input[name=marker]").fill("a17");
    await tab.page.getByTestId("me-report").click();
    await tab.page.getByText("3 waiting to be sent").waitFor();

    await tab.page.reload();
    await tab.page.getByTestId("me").waitFor();
    await tab.page.getByText("3 waiting to be sent").waitFor();
    const faults = mock.site.faults.length;
    mock.orders.loseVisitAnswer = true;
    await tab.context.setOffline(false);
    await tab.page.evaluate(() => dispatchEvent(new Event("online")));
    await tab.page.getByText(/[12] waiting to be sent/).waitFor();
    await tab.page.evaluate(() => dispatchEvent(new Event("online")));
    await allSent();
    assert.equal(mock.site.faults.length, faults + 1);
    await keyed()
      .first()
      .getByText(/^sent$|accepted/)
      .waitFor();

    await tab.page.getByRole("button", { name: "Stop" }).click();

    await tab.page.getByRole("button", { name: "Press again to end the walk" }).click();
    await tab.page.getByText("The walk has ended.").waitFor();
    await tab.page.goto(`${mock.url}/#/upload`);
    await tab.page.getByTestId("unfinished").getByText("A walk is waiting for its logs").waitFor();
  });

  test("every target is large enough for a glove", async () => {
    await choose("Chen Wei");
    await tab.page.getByTestId("me-chips").locator("button").first().waitFor();
    const small = await tab.page.evaluate(
      () =>
        [...document.querySelectorAll(".me button, .me select, .me summary")]
          .filter((el) => el.getClientRects().length > 0)
          .map((el) => el.getBoundingClientRect())
          .filter((box) => box.height < 44 || box.width < 44).length,
    );
    assert.equal(small, 0);
    const wide = await tab.page.evaluate(
      () => document.documentElement.scrollWidth - document.documentElement.clientWidth,
    );
    assert.ok(wide <= 0, `${wide} px too wide`);
  });

  test("nothing went wrong but the links that were cut", () => {
    const rest = tab.wrongs.filter(
      (w) => !/ERR_INTERNET_DISCONNECTED|ERR_EMPTY_RESPONSE|ERR_CONNECTION|WebSocket|ERR_FAILED/.test(w),
    );
    assert.deepEqual(rest, []);
  });
});
