// Logs on a real server: handed in, refused, gone on with after a cut and a reload.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, PNG, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;

describe("logs, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;
  /** @type {Record<"left" | "right", Buffer>} */
  let short;

  before(async () => {
    real = await startReal();
    await real.post("/markers/import", "name,e_m,n_m,u_m\nA17,10,20,0\n", { "Content-Type": "text/csv" });
    await real.post("/inspectors", { name: "李娜" });
    short = await real.walk("line:20");
    tab = await openPage(real.url);
  });
  after(async () => {
    await tab?.close();
    await real?.stop();
  });
  beforeEach(async () => {
    await tab.page.goto("about:blank");
    await tab.page.goto(`${real.url}/#/upload`);
    await tab.page.getByTestId("drop").waitFor();
  });
  const csv = (/** @type {string} */ name, /** @type {Buffer} */ buffer) => ({ name, mimeType: "text/csv", buffer });
  const give = (/** @type {{name: string, mimeType: string, buffer: Buffer}[]} */ files) =>
    tab.page.getByTestId("files").setInputFiles(files);
  const handIn = () => tab.page.getByRole("button", { name: "Upload" }).click();
  const refusals = () => tab.wrongs.splice(0, Infinity, ...tab.wrongs.filter((w) => !/\b(422|409)\b/.test(w)));

  test("both feet are handed in; the walk is worked out and opens", async () => {
    await give([csv("walk-left.csv", short.left), csv("walk-right.csv", short.right)]);
    for (const foot of ["left", "right"])
      await tab.page.getByTestId(`preview-${foot}`).getByText("Canonical CSV").waitFor();
    await tab.page
      .getByTestId("in-time")
      .getByText(/overlap/)
      .waitFor();
    await tab.page.locator("select[name=inspector]").selectOption({ label: "李娜" });
    await tab.page.locator("input[name=title]").fill("Along the road");
    await tab.page.locator("input[name=marker]").fill("a17");
    await handIn();
    await tab.page.getByTestId("upload-done").getByText("Upload complete.").waitFor({ timeout: 60_000 });
    await tab.page.getByText("Open the track").click();
    await tab.page.locator("[data-testid=session][data-drawn=yes]").waitFor();
    await tab.page.getByRole("heading", { name: "Along the road" }).waitFor();
    const [walk] = await real.get("/sessions?state=finished");
    assert.deepEqual([walk.start.marker, walk.feet], ["A17", ["left", "right"]]);
    assert.ok(Math.abs(walk.distance_m - 20) < 5, `${walk.distance_m} m`);
  });

  test("a picture is refused before anything is sent, and leaves no walk behind when it is sent all the same", async () => {
    const before = (await real.get("/sessions")).length;
    await give([{ name: "left.csv", mimeType: "text/csv", buffer: PNG }]);
    await tab.page.getByTestId("preview-left").getByText("found a PNG picture").waitFor();
    await tab.page.locator("input[name=marker]").fill("A17");
    await handIn();
    await tab.page.locator(".answer").getByText("found a PNG picture").waitFor();
    await becomes(async () => (await real.get("/sessions")).length, before);
    assert.equal(await tab.page.getByTestId("unfinished").count(), 0, "there is nothing to go on with");
    refusals();
  });

  test("a text that is no log is called by no format", async () => {
    await give([csv("left.csv", Buffer.from("dear diary,\nnothing was measured today\n"))]);
    const preview = tab.page.getByTestId("preview-left");
    await preview
      .getByTestId("preview-problem")
      .getByText(/expected a column/)
      .waitFor();
    await becomes(() => preview.getByTestId("format").textContent(), "Unknown format");
  });

  test("degrees where radians belong: what was expected, what was found, what to do", async () => {
    const [head, ...rows] = short.left.toString().trim().split("\n");
    const gyr = head.split(",").map((name) => name.startsWith("gyr"));
    const degrees = rows.map((row) =>
      row
        .split(",")
        .map((cell, i) => (gyr[i] && cell !== "" ? String((Number(cell) * 180) / Math.PI) : cell))
        .join(","),
    );
    await give([csv("left.csv", Buffer.from(`${head}\n${degrees.join("\n")}\n`))]);
    const preview = tab.page.getByTestId("preview-left");
    await preview
      .getByTestId("preview-problem")
      .getByText(/degrees/)
      .waitFor();
    await tab.page.locator("input[name=marker]").fill("A17");
    await handIn();
    const problem = tab.page.getByTestId("problem");
    await problem.getByText("degrees_not_radians").waitFor();
    await problem.getByText(/rad\/s/).waitFor();
    refusals();
    // The right log then goes its way.
    await give([csv("left.csv", short.left), csv("right.csv", short.right)]);
    await handIn();
    // It was handed in before: its walk is offered.
    const here = tab.page.getByTestId("already-here");
    const [known] = await real.get("/sessions?state=finished");
    assert.equal(await here.getByRole("link").first().getAttribute("href"), `#/sessions/${known.id}`);
    await here.getByRole("button", { name: "Upload anyway" }).click();
    await tab.page.getByTestId("upload-done").waitFor({ timeout: 60_000 });
  });

  test("one file for both feet is pointed out before it is sent", async () => {
    await give([csv("left.csv", short.left), csv("right.csv", short.left)]);
    await tab.page.getByTestId("same-file").waitFor();
    await give([csv("right.csv", short.right)]);
    await becomes(() => tab.page.getByTestId("same-file").count(), 0);
  });

  test(
    "a link that is cut, and a page that is opened anew, cost only the piece under way",
    { timeout: 180_000 },
    async () => {
      const long = await real.walk("line:600");
      assert.ok(long.left.length > 4 << 20, `${long.left.length} bytes: expected more than one piece`);
      await give([csv("left.csv", long.left)]);
      await tab.page.locator("input[name=marker]").fill("A17");
      let sent = 0;
      let cut = false;
      await tab.page.route("**/api/v1/logs/*", async (route) => {
        if (route.request().method() !== "PATCH") return route.continue();
        if (sent > 0) {
          cut = true;
          return route.abort();
        }
        // The first piece arrives, its answer does not.
        sent += (await route.request().postDataBuffer())?.length ?? 0;
        await route.fetch();
        return route.abort();
      });
      await handIn();
      await becomes(async () => cut, true);
      tab.page.once("dialog", (dialog) => dialog.accept());
      await tab.page.unroute("**/api/v1/logs/*");
      await tab.page.reload();
      await tab.page.getByTestId("unfinished").getByText("left.csv").waitFor();
      const begun = (await real.get("/sessions?state=receiving"))[0];
      const [log] = (await real.get(`/sessions/${begun.id}`)).logs;
      assert.ok(
        log.offset_bytes >= 4 << 20 && log.offset_bytes < long.left.length,
        `${log.offset_bytes} bytes are on disk`,
      );
      /** @type {number[]} */
      const offsets = [];
      tab.page.on("request", (request) => {
        if (request.method() === "PATCH") offsets.push(Number(request.headers()["upload-offset"]));
      });
      await give([csv("left.csv", long.left)]);
      await handIn();
      await tab.page.getByTestId("upload-done").waitFor({ timeout: 120_000 });
      assert.deepEqual(offsets[0], log.offset_bytes, "it goes on from what is on disk");
      assert.equal((await real.get(`/sessions/${begun.id}`)).state, "finished");
      tab.wrongs.splice(0, Infinity, ...tab.wrongs.filter((w) => !/ERR_FAILED|409/.test(w)));
    },
  );

  test("nothing went wrong", () => assert.deepEqual(tab.wrongs, []));
});
