// Faults in a real browser, against the mock server: reported, assigned, seen to step by step, with photos and history.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;
/** One white pixel. */
const PNG = Buffer.from(
  "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsGl0wAAAAABJRU5ErkJggg==",
  "base64",
);

describe("faults", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock();
    tab = await openPage(mock.url);
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  beforeEach(() => tab.page.goto("about:blank"));
  const visit = async (/** @type {string} */ hash) => {
    await tab.page.goto(`${mock.url}/${hash}`);
    await tab.page.locator("html[data-ready=yes]").waitFor();
  };
  const cards = () => tab.page.getByTestId("faults").getByTestId("fault-card");
  const details = () => tab.page.getByTestId("fault-details");
  const state = () => tab.page.getByTestId("fault-state").textContent();

  test("a fault is reported for somebody who calls, and the second time the first is offered", async () => {
    await visit("#/faults");
    const dialog = tab.page.getByTestId("dialog-fault");
    await tab.page.getByTestId("report-call").click();
    await dialog.locator("[name=inspector_id]").selectOption({ label: "Novak, Petr" });
    await dialog.locator("select[name=kind]").selectOption("drainage");
    await dialog.locator("[name=marker_typed]").fill("b12");
    await dialog.getByRole("button", { name: "Report", exact: true }).click();
    await dialog.getByRole("button", { name: "Close" }).click();
    await cards().filter({ hasText: "Novak, Petr" }).waitFor();

    await tab.page.getByTestId("report-call").click();
    await dialog.locator("select[name=kind]").selectOption("drainage");
    await dialog.locator("[name=marker_typed]").fill("B12");
    await dialog.getByText("at B12 is already reported").waitFor();
    await dialog.getByRole("link", { name: "Open it" }).click();
    await details().getByText("Novak, Petr").first().waitFor();
    await dialog.waitFor({ state: "hidden" });
  });

  test("a fault is reported from where somebody stands, with a photo, and goes its way until it is verified", async () => {
    await visit("#/live");
    await tab.page.locator('[data-inspector="i1"]').click();
    await tab.page.getByTestId("report-fault").click();
    const dialog = tab.page.getByTestId("dialog-fault");
    await dialog.locator("select[name=kind]").selectOption("anchor_bolt");
    await dialog.getByText("high").click();
    await dialog.locator("[name=photo]").setInputFiles({ name: "bolt.png", mimeType: "image/png", buffer: PNG });
    await dialog.getByRole("button", { name: "Report", exact: true }).click();
    await dialog.getByText("50 %").waitFor();
    await dialog.getByRole("button", { name: "Close" }).click();

    await visit("#/faults");
    await cards().filter({ hasText: "Anchor bolt" }).click();
    await details().getByTestId("photo-shown").waitFor();
    await details().locator("[name=comment]").fill("<i>seen</i>");
    await tab.page.getByTestId("step-acknowledged").click();
    await becomes(state, "acknowledged");
    await tab.page.getByTestId("fault-history").getByText("<i>seen</i>").waitFor();
    const first = tab.page.getByTestId("helper").first();
    const name = await first.locator("b").textContent();
    await first.click();
    await tab.page.getByTestId("fault-history").getByText(`assigned to ${name}`).waitFor();
    await tab.page.getByTestId("step-in_work").click();
    await becomes(state, "in progress");
    await tab.page.getByTestId("step-fixed").click();
    await becomes(state, "fixed");
    await tab.page.getByTestId("step-verified").click();
    await becomes(state, "verified");
    await becomes(() => cards().filter({ hasText: "Anchor bolt" }).count(), 0);
    await tab.page.locator("[data-filter=state]").selectOption("verified");
    await becomes(() => cards().count(), 1);
    await tab.page.getByTestId("step-open").click();
    await becomes(state, "open");
  });

  test("filters by state, severity, person and words", async () => {
    await visit("#/faults");
    const all = mock.site.faults.length;
    await becomes(() => cards().count(), all);
    await tab.page.locator("[data-filter=severity]").selectOption("low");
    await becomes(() => cards().count(), mock.site.faults.filter((f) => f.severity === "low").length);
    await tab.page.locator("[data-filter=severity]").selectOption("");
    await tab.page.locator("[data-filter=assignee]").selectOption("nobody");
    await becomes(() => cards().count(), all - 1);
    await tab.page.locator("[data-filter=assignee]").selectOption("");
    await tab.page.locator("#side input[type=search]").fill("anchor");
    await becomes(() => cards().count(), 1);
  });

  test("what is known better is changed, and stays text", async () => {
    await visit("#/faults");
    await cards().first().click();
    await tab.page.getByTestId("edit-fault").locator("summary").click();
    await details().locator("textarea").fill("<script>alert(1)</script>");
    await details().getByRole("radio", { name: "low" }).check();
    await tab.page.getByTestId("save-fault").click();
    await details().locator("p", { hasText: "<script>alert(1)</script>" }).waitFor();
    await tab.page.getByTestId("fault-history").getByText("remarks edited").waitFor();
    await tab.page
      .getByTestId("fault-history")
      .getByText(/Severity: .* → low/)
      .waitFor();
  });

  test("a change by somebody else is told, and what was written here stays", async () => {
    await visit("#/faults");
    await cards().first().click();
    await details().locator("[name=comment]").fill("my words");
    const id = await details().getAttribute("data-of");
    const fault = mock.site.faults.find((f) => f.id === id);
    fault.version = (fault.version ?? 1) + 5;
    fault.state = "in_work";
    await tab.page.locator("[data-part=steps] button").first().click();
    await details().getByText("fault_changed").waitFor();
    await becomes(state, "in progress");
    assert.equal(await details().locator("[name=comment]").inputValue(), "my words");
    tab.wrongs.splice(0, tab.wrongs.length, ...tab.wrongs.filter((w) => !w.includes("409")));
  });

  test("a photo that is none is refused in words; one that is can be removed", async () => {
    await visit("#/faults");
    await cards().last().click();
    await tab.page
      .getByTestId("photo")
      .setInputFiles({ name: "x.png", mimeType: "image/png", buffer: Buffer.from("<svg/>") });
    await details().getByText("not_a_photo").waitFor();
    await tab.page.getByTestId("photo").setInputFiles({ name: "x.png", mimeType: "image/png", buffer: PNG });
    await tab.page.getByTestId("photo-shown").waitFor();
    await details().getByRole("button", { name: "Remove" }).click();
    await tab.page.getByTestId("photo-shown").waitFor({ state: "detached" });
    tab.wrongs.splice(0, tab.wrongs.length, ...tab.wrongs.filter((w) => !w.includes("422")));
  });

  test("nothing went wrong: no error, no report of the policy, no request to another host", () => {
    assert.deepEqual(tab.wrongs, []);
  });
});
