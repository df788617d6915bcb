// A system that the page has no file for, in a real browser against the mock: on the map, in a replay, handed in.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { PEDESTRIAN, RAFT } from "../mock/systems.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;
const LOG = `t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n${"0.00,0,0,0,0,0,9.8\n".repeat(50)}`;

describe("systems beside the first", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock({ stepMs: 100, systems: [PEDESTRIAN, RAFT] });
    for (const session of mock.site.sessions.values()) session.system = "pedestrian";
    mock.site.sessions.get("s2").system = "raft";
    mock.walks.get("s8").system = "raft";
    tab = await openPage(mock.url);
    await tab.page.goto(mock.url);
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });

  test("its carriers have another sign on the map, with trail and ellipse like everybody", async () => {
    const { page } = tab;
    const signs = page.getByTestId("map-person");
    await becomes(() => signs.locator("rect.disc").count(), 1);
    await becomes(() => signs.locator("circle.disc").count(), (await signs.count()) - 1);
    await page.getByTestId("inspector-row").nth(1).click();
    await page.locator("#drawer").getByRole("heading").first().waitFor();
  });

  test("its replay has the charts that it declares and none of the first system's", async () => {
    const { page } = tab;
    await page.goto(`${mock.url}/#/sessions/s8?t=100`);
    await page.locator("[data-testid=session][data-charted=yes][data-compared=yes]").waitFor();
    const readout = page.getByTestId("readout");
    await becomes(() => readout.locator("[data-figure=time]").textContent(), "1:40.0");
    assert.equal(await readout.locator("[data-of-system]").count(), 0);
    const groups = page.locator(".plot-groups [data-group]");
    assert.deepEqual(await groups.allTextContents(), ["Motion", "Measured", "Heading", "σ", "Innovations", "Height"]);
    await page.locator("[data-plot=depth]").getByText("depth · m").waitFor();
    assert.equal(await page.locator("[data-plot=gyro_norm]").count(), 0);
    await page.getByRole("tab", { name: "Quality" }).click();
    await page.getByTestId("health").waitFor();
  });

  test("its streams are handed in under its name", async () => {
    const { page } = tab;
    await page.goto(`${mock.url}/#/upload`);
    await page.getByTestId("foot-left").waitFor();
    await page.locator("select[name=system]").selectOption({ label: "Raft" });
    await page.getByTestId("stream-range_1").getByText("t_s, depth_m, quality?").waitFor();
    assert.equal(await page.locator(".swap").count(), 0);
    await page.getByTestId("files").setInputFiles([
      { name: "range_1.csv", mimeType: "text/csv", buffer: Buffer.from("t_s,depth_m\n0,4\n") },
      { name: "log.csv", mimeType: "text/csv", buffer: Buffer.from(LOG) },
    ]);
    await page.getByTestId("stream-bow").getByText("log.csv").waitFor();
    await page.getByTestId("preview-bow").getByText("Canonical CSV").waitFor();
    // It says itself where it is: nobody is asked where it began, nor warned of a short stand.
    assert.equal(await page.locator("[name=start], [name=marker], [name=heading], [data-warning=still]").count(), 0);
    await page.locator("select[name=inspector]").selectOption({ index: 2 });
    const [begun, first] = await Promise.all([
      page.waitForRequest((r) => r.method() === "POST" && r.url().endsWith("/api/v1/sessions")),
      page.waitForRequest((r) => r.method() === "POST" && r.url().endsWith("/logs")),
      page.getByRole("button", { name: "Upload" }).click(),
    ]);
    const { system, streams, start } = begun.postDataJSON();
    assert.deepEqual(
      [system, streams, start, first.postDataJSON().stream],
      ["raft", ["bow", "range_1"], undefined, "bow"],
    );
  });

  test("an address leads to the upload of a system, and nothing went wrong on the way", async () => {
    const { page } = tab;
    await page.goto("about:blank");
    await page.goto(`${mock.url}/#/upload/raft`);
    await page.getByTestId("stream-bow").waitFor();
    await becomes(() => page.locator("select[name=system]").inputValue(), "raft");
    assert.deepEqual(
      tab.wrongs.filter((wrong) => !/422|404/.test(wrong)),
      [],
    );
  });
});
