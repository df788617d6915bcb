// Logs looked at before they are handed in: known formats, a table whose columns are mapped, a dry run.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;
const X_IO =
  "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n0,1,2,3,0,0,1\n";
const OWN = "secs,wx,wy,wz,fx,fy,fz\n0.00,1,2,3,0,0,9.8\n0.01,1,2,3,0,0,9.8\n";
const CANONICAL = "t_s,gyr_x_rad_s,gyr_y_rad_s\n0.01,0.1,0.2\n";

describe("a log before it is handed in", { skip }, () => {
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
    await tab.page.goto(`${mock.url}/#/upload`);
    await tab.page.getByTestId("drop").waitFor();
  });
  const give = (/** @type {Record<string, string>} */ files) =>
    tab.page
      .getByTestId("files")
      .setInputFiles(
        Object.entries(files).map(([name, text]) => ({ name, mimeType: "text/csv", buffer: Buffer.from(text) })),
      );

  test("the format is told, what the log is worth, and how the feet lie in time", async () => {
    await give({ "left.csv": X_IO, "right.csv": X_IO });
    const left = tab.page.getByTestId("preview-left");
    await left.getByText("x-io NGIMU / x-IMU3 CSV").waitFor();
    await becomes(() => left.locator("[data-fact=rate]").textContent(), "100 Hz");
    await left.getByText("1 gaps, 0.31 s in total.").waitFor();
    await becomes(() => left.locator("svg polygon").count(), 2);
    await tab.page
      .getByTestId("in-time")
      .getByText(/Common clock: .* overlap for 1 min 53 s/)
      .waitFor();
    await left.getByText("First rows").click();
    await becomes(() => left.locator("tbody td").first().textContent(), "0.0000");
  });

  test("a table that nobody knows is mapped, the mapping is kept, and used by itself the next time", async () => {
    await give({ "left.csv": OWN, "right.csv": OWN });
    await tab.page.getByTestId("preview-left").getByText("Unknown format").waitFor();
    const form = tab.page.getByTestId("mapping");
    await becomes(() => form.locator("[name=gyr_y]").inputValue(), "wy");
    await form.locator("[name=acc_unit]").selectOption("m_s2");
    await form.locator("[name=preset_name]").fill("Our logger");
    await tab.page.getByTestId("save-mapping").click();
    for (const foot of ["left", "right"])
      await tab.page.getByTestId(`preview-${foot}`).getByText("Table, columns mapped").waitFor();
    await becomes(() => form.count(), 0);
    await tab.page.reload();
    await give({ "left.csv": OWN });
    await tab.page.getByTestId("preview-left").getByText("Table, columns mapped").waitFor();
  });

  test("a file that was not meant is taken off", async () => {
    await give({ "left.csv": CANONICAL.repeat(20), "right.csv": CANONICAL.repeat(20) });
    await tab.page.getByTestId("preview-right").getByText("Canonical CSV").waitFor();
    const right = tab.page.getByTestId("foot-right");
    await right.getByTitle("Remove this file").click();
    await right.getByText("No file yet").waitFor();
    await becomes(() => tab.page.getByTestId("preview-right").textContent(), "");
    await becomes(() => right.getByTitle("Remove this file").isVisible(), false);
  });

  test("a dry run looks at the whole and stores nothing; handing in then sends nothing again", async () => {
    await give({ "left.csv": CANONICAL.repeat(20) });
    await tab.page.getByTestId("preview-left").getByText("Canonical CSV").waitFor();
    await tab.page.locator("input[name=marker]").fill("A17");
    await tab.page.locator("select[name=inspector]").selectOption({ label: "Chen Wei" });
    await tab.page.getByTestId("dry-run").click();
    await tab.page.getByTestId("dry-run-done").getByText("every row can be read").waitFor();
    await tab.page.getByTestId("unfinished").waitFor();
    await tab.page.getByRole("button", { name: "Upload" }).click();
    await tab.page.getByTestId("upload-done").waitFor();
  });

  test("nothing went wrong", () => assert.deepEqual(tab.wrongs, []));
});
