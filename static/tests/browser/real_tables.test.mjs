// Tables that nobody has shown to the program before: dropped on the page, their columns are mapped right without a click for
// most of them.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { gunzipSync } from "node:zlib";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;
const CASES = fileURLToPath(new URL("../../../tests/data/cases/", import.meta.url));
/** The share of tables that has to be right. */
const LEAST = 0.8;

/** Logs, each with its mapping: columns of time, rate and force, and their units. @type {[string, string[], string[]][]} */
const LOGS = [
  ["iso-zone/left.csv.gz", ["ts", "gx", "gy", "gz", "ax", "ay", "az"], ["date_time", "rad_s", "m_s2"]],
  [
    "units-row/left.csv.gz",
    [
      "Time",
      ...["X", "Y", "Z"].map((axis) => `Foot/Angular Velocity/${axis}`),
      ...["X", "Y", "Z"].map((axis) => `Foot/Acceleration/${axis}`),
    ],
    ["s", "rad_s", "m_s2"],
  ],
  ["no-header/left.csv.gz", ["1", "2", "3", "4", "5", "6", "7"], ["s", "rad_s", "m_s2"]],
];

/** Tables of markers, each with its frame, and which column is name, east or latitude, north or longitude, and height. @type {[string, string, string[]][]} */
const MARKERS = [
  ["survey-axes/anchors.csv", "local", ["0", "2", "1", "3"]],
  ["survey-axes/three.csv", "local", ["0", "2", "1", "3"]],
  ["regional-table/semicolon.csv", "local", ["0", "1", "2", "3"]],
  ["regional-table/tab-utf16.txt", "local", ["0", "1", "2", "3"]],
  ["regional-table/sep-line.csv", "local", ["0", "1", "2", "3"]],
  ["wide-digits/markers.csv", "local", ["0", "1", "2", "3"]],
  ["degrees-minutes-seconds/markers.csv", "geographic", ["0", "1", "2", "3"]],
  ["names-for-a-spreadsheet/markers.csv", "local", ["0", "1", "2", "3"]],
  ["look-alike-names/markers.csv", "local", ["0", "1", "2", "3"]],
  ["zone-in-the-easting/markers.csv", "local", ["0", "2", "1", "3"]],
];

describe("tables of other people, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;
  let right = 0;
  /** @type {string[]} */
  const wrong = [];
  const count = (/** @type {string} */ file, /** @type {unknown} */ found, /** @type {unknown} */ expected) => {
    if (JSON.stringify(found) === JSON.stringify(expected)) right += 1;
    else wrong.push(`${file}: ${JSON.stringify(found)}`);
  };

  before(async () => {
    real = await startReal();
    tab = await openPage(real.url);
  });
  after(async () => {
    await tab?.close();
    await real?.stop();
  });

  test("logs", async () => {
    for (const [file, columns, units] of LOGS) {
      await tab.page.goto("about:blank");
      await tab.page.goto(`${real.url}/#/upload`);
      await tab.page.getByTestId("drop").waitFor();
      const buffer = gunzipSync(await readFile(CASES + file));
      await tab.page.getByTestId("files").setInputFiles([{ name: "left.csv", mimeType: "text/csv", buffer }]);
      const form = tab.page.getByTestId("mapping");
      await form.waitFor();
      const value = (/** @type {string} */ name) => form.locator(`[name=${name}]`).inputValue();
      const fields = ["time", "gyr_x", "gyr_y", "gyr_z", "acc_x", "acc_y", "acc_z"];
      const found = await Promise.all(fields.map(value));
      const said = await Promise.all(["time_unit", "gyr_unit", "acc_unit"].map(value));
      count(file, [found, said], [columns, units]);
    }
    // What the server refused to guess is told as a problem of the log; the page asks.
    tab.wrongs.splice(0);
  });

  test("markers", async () => {
    for (const [file, frame, columns] of MARKERS) {
      await tab.page.goto("about:blank");
      await tab.page.goto(`${real.url}/#/markers`);
      await tab.page.getByTestId("import-markers").click();
      await tab.page
        .getByTestId("markers-file")
        .setInputFiles({ name: "survey.csv", mimeType: "text/csv", buffer: await readFile(CASES + file) });
      const wizard = tab.page.getByTestId("wizard");
      await wizard.locator("select[name=name]").waitFor();
      const fields = frame === "local" ? ["e_m", "n_m", "u_m"] : ["latitude_deg", "longitude_deg", "height_m"];
      const found = await Promise.all(
        ["name", ...fields].map((name) => wizard.locator(`select[name=${name}]`).inputValue()),
      );
      count(file, [await wizard.locator("[name=frame]:checked").inputValue(), found], [frame, columns]);
    }
  });

  test("most of them need no click", () => {
    const all = LOGS.length + MARKERS.length;
    assert.ok(right >= LEAST * all, `${right} of ${all} are right; ${wrong.join("; ")}`);
    console.log(`# ${right} of ${all} tables mapped right without a click`);
  });
});
