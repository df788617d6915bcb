// What the control room leaves open all day: alarms, people on one spot, and a look back. In a real browser against the mock.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("the control room", { skip }, () => {
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
  beforeEach(async () => {
    await tab.page.goto("about:blank");
    await visit("#/live");
    await tab.page.locator('[data-inspector="i1"]').waitFor();
  });
  const visit = async (/** @type {string} */ hash) => {
    await tab.page.goto(`${mock.url}/${hash}`);
    await tab.page.locator("html[data-ready=yes]").waitFor();
  };
  const signs = () => tab.page.locator("[data-testid=map-person]:visible").count();

  test("an alarm stays until somebody acknowledges it; one that the server ends goes by itself", async () => {
    const panel = tab.page.getByTestId("alarm-panel");
    await panel.getByText("New high-severity fault near A57").waitFor();
    const stands = {
      key: "standing:s2:1",
      kind: "standing",
      session_id: "s2",
      inspector_id: "i2",
      fault_id: null,
      since: "2026-07-01T08:00:00Z",
      raised_at: "2026-07-01T08:15:00Z",
    };
    mock.site.publish([{ kind: "alarm_raised", alarm: stands }]);
    await panel.getByText("李娜 has not moved since 16:00:00").waitFor();
    await panel.locator('[data-acknowledge="fault:f1"]').click();
    await becomes(() => panel.getByRole("listitem").count(), 1);
    mock.site.publish([{ kind: "alarm_ended", key: stands.key }]);
    await panel.waitFor({ state: "hidden" });
  });

  test("people on one spot are one sign with a count, which fans out when it is pressed", async () => {
    await becomes(signs, 4);
    const [first] = mock.site.walks;
    for (const walk of mock.site.walks) Object.assign(walk, { s: first.s, speed: first.speed, standing: 0 });
    await becomes(signs, 1);
    const count = tab.page.locator(".person-count:visible");
    assert.equal(await count.innerText(), "+3");
    assert.match(
      String(await tab.page.locator(".person:has(.person-count:visible)").getAttribute("aria-label")),
      /3 more/,
    );
    await tab.page.locator("[data-testid=map-person]:visible").first().dispatchEvent("click");
    await becomes(signs, 4);
    const middles = await tab.page.locator(".person-name:visible").evaluateAll((names) =>
      names.map((name) => {
        const { x, y } = name.getBoundingClientRect();
        return `${Math.round(x / 8)} ${Math.round(y / 8)}`;
      }),
    );
    assert.equal(new Set(middles).size, 4, "each stands for itself");
    await tab.page.getByTestId("map").click({ position: { x: 30, y: 500 } });
    await becomes(signs, 1);
  });

  test("a look back shows where everybody was, stands in the address, and ends with one press", async () => {
    const bar = tab.page.getByTestId("past-bar");
    await tab.page.locator("#toggle-past").click();
    await bar.getByText("under way").waitFor();
    const at = new URLSearchParams(new URL(tab.page.url()).hash.split("?")[1]).get("at") ?? "";
    const then = mock.site.moment(Date.parse(at)).walks.find((walk) => walk.session.id === "s1");
    const east = then?.position?.position_m[0].toFixed(3);
    await becomes(() => tab.page.locator('[data-inspector="i1"]').getAttribute("data-east-m"), east);
    await tab.page.waitForTimeout(500);
    assert.equal(
      await tab.page.locator('[data-inspector="i1"]').getAttribute("data-east-m"),
      east,
      "what comes in meanwhile moves nobody",
    );

    await bar.locator("[data-step='-1']").click();
    const before = new Date(Date.parse(at) - 60_000).toISOString().slice(11, 16).replace(":", "%3A");
    await tab.page.waitForFunction((minute) => location.hash.includes(minute), before);
    const address = tab.page.url();
    await tab.page.goto("about:blank");
    await tab.page.goto(address);
    await bar.getByText("under way").waitFor();
    await tab.page.locator('[data-inspector="i1"]').click();
    await tab.page.getByTestId("drawer").getByText("Chen Wei").waitFor();
    assert.equal(await tab.page.getByTestId("report-fault").isVisible(), false, "what is past is looked at");

    await bar.getByRole("button", { name: "Back to live" }).click();
    await bar.waitFor({ state: "hidden" });
    await tab.page.waitForFunction(
      (was) => document.querySelector('[data-inspector="i1"]')?.getAttribute("data-east-m") !== was,
      east,
    );
    assert.ok(!tab.page.url().includes("at="));
  });
});
