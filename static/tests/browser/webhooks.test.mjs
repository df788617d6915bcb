// Webhooks in a real browser against the mock: registered, tried out, switched off and on, removed.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("webhooks", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock({ stepMs: 500 });
    tab = await openPage(mock.url);
    tab.page.on("dialog", (dialog) => dialog.accept());
    await tab.page.goto(`${mock.url}/#/admin/webhooks`);
    await tab.page.getByText("No webhooks yet").waitFor();
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  const register = async (/** @type {string} */ name) => {
    const form = tab.page.locator(".new-webhook");
    await form.locator("[name=name]").fill(name);
    await form.locator("[name=url]").fill("http://10.0.0.9:9000/hook");
    await form.getByRole("button", { name: "Register" }).click();
    await tab.page.getByTestId("webhooks").getByText(name, { exact: true }).waitFor();
  };
  const row = (/** @type {string} */ id) => tab.page.locator(`[data-webhook="${id}"]`);

  test("its secret is shown once; tried out, it says what was answered", async () => {
    const { page } = tab;
    await page.getByLabel("fault changed").uncheck();
    await register("<b>tickets</b>");
    assert.deepEqual(mock.webhooks.hooks[0].events, [
      "fault.reported",
      "anomalies.found",
      "alarm.raised",
      "alarm.acknowledged",
    ]);
    assert.equal(await page.getByTestId("webhook-secret").textContent(), "5ec4e7".repeat(10));
    await row("w1").getByRole("button", { name: "Send test" }).click();
    await page.getByTestId("webhook-secret").waitFor({ state: "detached" });
    await page.getByTestId("deliveries").getByText("delivered").waitFor();
    await page.getByTestId("deliveries").getByText("204 · 12 ms").waitFor();
  });

  test("one that does not answer says since when, and one that was switched off says why", async () => {
    const { page } = tab;
    await register("down");
    await row("w2").getByRole("button", { name: "Send test" }).click();
    await row("w2").getByText("failing").waitFor();
    await page.getByTestId("deliveries").getByText("connection refused").waitFor();
    Object.assign(mock.webhooks.hooks[1], {
      enabled: false,
      disabled_why: "expected an answer of 2xx, found none for 72 h",
    });
    await page.reload();
    await row("w2").getByText("found none for 72 h").waitFor();
    assert.equal(await row("w2").getByRole("button", { name: "Send test" }).isDisabled(), true);
    await row("w2").getByRole("button", { name: "Enable" }).click();
    await row("w2").getByRole("button", { name: "Disable" }).waitFor();
    await row("w2").getByRole("button", { name: "New secret" }).click();
    await page.getByTestId("webhook-secret").waitFor();
    await row("w2").getByRole("button", { name: "Remove" }).click();
    await row("w2").waitFor({ state: "detached" });
  });

  test("nothing went wrong", () => assert.deepEqual(tab.wrongs, []));
});
