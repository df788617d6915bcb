// The markers' screen in a real browser, against the mock server: found, edited, dragged, imported, reverted.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("the markers' screen", { skip }, () => {
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
  beforeEach(async () => {
    await tab.page.goto("about:blank");
    await tab.page.goto(`${mock.url}/#/markers`);
    await rows().first().waitFor();
  });
  const rows = () => tab.page.getByTestId("markers").locator("tbody tr");
  const drawer = () => tab.page.getByTestId("drawer");
  const choose = async (/** @type {string} */ name) => {
    await tab.page.locator("#side input[type=search]").fill(name);
    await tab.page.locator(`[data-marker="${name}"]`).click();
    await drawer().getByRole("heading", { name, exact: true }).waitFor();
  };
  const now = (/** @type {string} */ name) => mock.markers.table.get(name);

  test("search, sector and suspicion narrow the table", async () => {
    await tab.page.locator("#side input[type=search]").fill("b11");
    await becomes(() => rows().count(), 11);
    await tab.page.locator("#side input[type=search]").fill("");
    await tab.page.locator("[data-filter=sector]").selectOption("C");
    await becomes(() => rows().first().locator("button").textContent(), "C1");
    await tab.page.locator("[data-filter=sector]").selectOption("");
    await tab.page.getByTestId("suspects").click();
    await becomes(() => rows().count(), 1);
    await rows().first().getByRole("button", { name: "A17" }).click();
    await drawer().getByText("suspect survey").waitFor();
    await drawer().getByText("6 in 4 walks, 1 rejected").waitFor();
  });

  test("an edit takes a reason and is in the history", async () => {
    await choose("B20");
    await drawer().getByRole("button", { name: "Edit" }).click();
    await drawer().locator("[name=u_m]").fill("12.345");
    await tab.page.getByTestId("save-marker").click();
    assert.notEqual(now("B20").u_m, 12.345, "not without a reason");
    await drawer().locator("[name=reason]").fill("<b>levelled</b> again");
    await tab.page.getByTestId("save-marker").click();
    await tab.page.getByTestId("history").getByText("<b>levelled</b> again").waitFor();
    assert.equal(now("B20").u_m, 12.345);
  });

  test("a marker is dragged only in edit mode, by keyboard too, and every move is undone", async () => {
    await choose("B30");
    const was = { ...now("B30") };
    assert.equal(await tab.page.getByTestId("drag-handle").count(), 0);
    await drawer().getByRole("button", { name: "Edit" }).click();
    await tab.page.getByTestId("drag").click();
    const handle = tab.page.getByTestId("drag-handle");
    const box = await handle.boundingBox();
    assert.ok(box);
    await tab.page.mouse.move(box.x + 17, box.y + 17);
    await tab.page.mouse.down();
    await tab.page.mouse.move(box.x + 77, box.y + 17, { steps: 6 });
    await tab.page.mouse.up();
    const east = async () => Number(await drawer().locator("[name=e_m]").inputValue());
    const dragged = await east();
    assert.ok(dragged > was.e_m + 1, `${dragged} from ${was.e_m}`);
    await handle.focus();
    await tab.page.keyboard.press("Shift+ArrowRight");
    await becomes(async () => (await east()) - dragged > 0.99, true);
    await tab.page.getByTestId("undo-drag").click();
    await becomes(east, dragged);
    await tab.page.getByTestId("undo-drag").click();
    await becomes(async () => Math.abs((await east()) - was.e_m) < 0.011, true);
    assert.equal(now("B30").e_m, was.e_m, "nothing is saved yet");
    await drawer().getByRole("button", { name: "Cancel" }).click();
    assert.equal(await handle.count(), 0);
  });

  test("who is second is shown both and decides", async () => {
    await choose("B40");
    await drawer().getByRole("button", { name: "Edit" }).click();
    await drawer().locator("[name=e_m]").fill("50.5");
    await drawer().locator("[name=reason]").fill("mine");
    mock.markers.write([{ name: "B40", before: now("B40"), after: { e_m: 49, n_m: now("B40").n_m, u_m: 3 } }], {
      reason: "theirs",
    });
    await tab.page.getByTestId("save-marker").click();
    const conflict = tab.page.getByTestId("conflict");
    await conflict.getByText("49.000").waitFor();
    await conflict.getByText("50.500").waitFor();
    assert.equal(now("B40").e_m, 49);
    await conflict.getByRole("button", { name: "Use mine" }).click();
    await tab.page.getByTestId("history").getByText("mine").waitFor();
    assert.equal(now("B40").e_m, 50.5);
    tab.wrongs.splice(0, tab.wrongs.length, ...tab.wrongs.filter((w) => !w.includes("409")));
  });

  test("a file is compared, put right, applied and reverted", async () => {
    const some = ["D10", "D11", "D12", "D13"].map((name) => now(name));
    const csv = `name,east,n_m,u_m\n${some.map((m) => `${m.name},${m.n_m},${m.e_m},${m.u_m}`).join("\n")}\nD9999,10,20,3\n`;
    await tab.page.getByTestId("import-markers").click();
    await tab.page
      .getByTestId("markers-file")
      .setInputFiles({ name: "survey.csv", mimeType: "text/csv", buffer: Buffer.from(csv) });
    const findings = tab.page.getByTestId("findings");
    await findings.getByText("all: east and north swapped").waitFor();
    await findings.getByRole("button", { name: "Swap columns" }).click();
    await tab.page.getByTestId("difference").getByRole("button", { name: "1 added" }).waitFor();
    await tab.page.getByTestId("difference").getByRole("button", { name: "4 unchanged" }).waitFor();
    await findings.getByText("No problems found").waitFor();
    await tab.page.getByTestId("wizard").locator("[name=reason]").fill("autumn survey");
    await tab.page.getByTestId("apply-import").click();
    await tab.page.getByText("survey.csv: 1 added, 0 changed, 0 removed, 4 unchanged.").waitFor();
    assert.ok(mock.markers.table.has("D9999"));
    await tab.page
      .locator("[data-testid=import-row][data-state=applied]")
      .getByRole("button", { name: "Revert" })
      .click();
    await tab.page.locator("form.revert [name=reason]").fill("wrong station");
    await tab.page.getByTestId("revert-import").click();
    await tab.page.locator("[data-testid=import-row][data-state=reverted]").waitFor();
    assert.ok(!mock.markers.table.has("D9999"));
  });

  test("columns that are not recognised are chosen by hand", async () => {
    const m = now("E5");
    await tab.page.getByTestId("import-markers").click();
    await tab.page.getByTestId("markers-file").setInputFiles({
      name: "p.csv",
      mimeType: "text/csv",
      buffer: Buffer.from(`p,a,b,c\nE5,${m.e_m},${m.n_m + 0.5},${m.u_m}\n`),
    });
    await tab.page.getByText("columns not recognised").waitFor();
    const mapping = tab.page.getByTestId("mapping");
    for (const [field, column] of [
      ["name", "0"],
      ["u_m", "3"],
      ["e_m", "1"],
      ["n_m", "2"],
    ])
      await mapping.locator(`select[name=${field}]`).selectOption(column);
    await tab.page.getByTestId("difference").getByRole("button", { name: "1 changed" }).waitFor();
    await tab.page.getByTestId("difference").getByText("0.500").waitFor();
  });

  test("nothing went wrong: no error, no report of the policy, no request to another host", () => {
    assert.deepEqual(tab.wrongs, []);
  });
});
