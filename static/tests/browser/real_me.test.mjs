// The inspector's page on a real server: a walk without a link, handed over afterwards, its logs at the dock.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, linkTo, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;

describe("the inspector's page, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {Awaited<ReturnType<typeof linkTo>>} */
  let link;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    real = await startReal();
    await real.post("/markers/import", "name,e_m,n_m,u_m\nA17,10,20,0\nA18,14,20,0\n", { "Content-Type": "text/csv" });
    await real.post("/inspectors", { name: "李娜" });
    link = await linkTo(real.url);
    tab = await openPage(link.url, { viewport: { width: 390, height: 844 }, hasTouch: true });
  });
  after(async () => {
    await tab?.close();
    await link?.stop();
    await real?.stop();
  });

  test(
    "a walk is begun, walked and ended without a link, over a reload; all of it is handed over once",
    { timeout: 180_000 },
    async () => {
      const { page } = tab;
      const press = async (/** @type {string} */ keys) => {
        for (const key of keys) await page.locator(`[data-key="${key}"]`).click();
      };
      await page.goto(`${link.url}/#/me`);
      await page.getByTestId("me").waitFor();
      await page.locator("select[name=who] option", { hasText: "李娜" }).waitFor({ state: "attached" });
      await page.getByTestId("me-who").selectOption({ label: "李娜" });
      await page.getByText("This page also opens without a connection.").waitFor();
      await page.waitForFunction(async () => {
        const kept = (await (await caches.open("lodestep")).keys()).map(({ url }) => new URL(url).pathname);
        return ["/js/me/view.js", "/js/main.js", "/api/v1/site/plan", "/api/v1/markers", "/api/v1/account"].every(
          (path) => kept.includes(path),
        );
      });

      link.cut();
      await press("A17");
      await page.getByRole("button", { name: "Start a walk" }).click();
      await page.getByText("Walking for").waitFor();
      await press("A18");
      await page.getByTestId("me-enter").click();
      await page.getByTestId("me-fault").locator("summary").click();
      await page.getByTestId("me-fault").locator("[name=marker]").fill("a18");
      await page.getByTestId("me-report").click();
      await page.getByText("3 waiting to be sent").waitFor();
      await page.reload();
      await page.getByTestId("me").waitFor();
      await page.getByText("3 waiting to be sent").waitFor();
      await page.getByText("Walking for").waitFor();
      assert.deepEqual(await real.get("/sessions"), [], "the server knows nothing yet");

      link.mend();
      await page.evaluate(() => dispatchEvent(new Event("online")));
      await page.getByText("Everything has been sent.").waitFor();
      const [walk, ...others] = await real.get("/sessions");
      assert.deepEqual([others.length, walk.start.marker], [0, "A17"]);
      const visits = await real.get(`/sessions/${walk.id}/visits`);
      assert.deepEqual(
        visits.map((/** @type {any} */ v) => v.marker),
        ["A18"],
      );
      const faults = await real.get("/faults");
      assert.deepEqual(
        faults.map((/** @type {any} */ f) => [f.marker, f.session_id]),
        [["A18", walk.id]],
      );

      await page.getByRole("button", { name: "Stop" }).click();

      await page.getByRole("button", { name: "Press again to end the walk" }).click();
      await page.goto(`${link.url}/#/upload`);
      await page.getByTestId("unfinished").getByText("A walk is waiting for its logs").waitFor();
      const { left, right } = await real.walk("line:20");
      await page.getByTestId("files").setInputFiles([
        { name: "left.csv", mimeType: "text/csv", buffer: left },
        { name: "right.csv", mimeType: "text/csv", buffer: right },
      ]);
      await page.getByRole("button", { name: "Upload" }).click();
      await page.getByTestId("upload-done").waitFor({ timeout: 60_000 });
      const now = await real.get(`/sessions/${walk.id}`);
      assert.deepEqual([now.state, now.visits, (await real.get("/sessions")).length], ["finished", 1, 1]);
    },
  );

  test("nothing went wrong but the link that was cut", () => {
    assert.deepEqual(
      tab.wrongs.filter((w) => !/ERR_(CONNECTION_RESET|SOCKET_NOT_CONNECTED|EMPTY_RESPONSE|FAILED)|WebSocket/.test(w)),
      [],
    );
  });
});
