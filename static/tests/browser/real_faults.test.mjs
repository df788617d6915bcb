// A fault on a real server, from its report to its verification, with a photo, by those whose steps they are.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { becomes, findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, PNG, signInAt, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;
const PASSWORD = "a sentence nobody says";

describe("a fault, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {ReturnType<typeof real.as>} */
  let owner;
  /** @type {Awaited<ReturnType<typeof openPage>>} the inspector's */
  let hers;
  /** @type {Awaited<ReturnType<typeof openPage>>} the dispatcher's */
  let his;
  /** @type {any} */
  let lina;

  before(async () => {
    real = await startReal();
    await real.post("/markers/import", "name,e_m,n_m,u_m\nA17,10,20,0\nA18,20,20,0\n", { "Content-Type": "text/csv" });
    lina = await real.post("/inspectors", { name: "李娜" });
    owner = await real.setUp("Wang Fang", PASSWORD);
    await owner.post("/accounts", { name: "Li Na", password: PASSWORD, role: "inspector", inspector_id: lina.id });
    await owner.post("/accounts", { name: "Zhao Lei", password: PASSWORD, role: "dispatcher" });
    hers = await openPage(real.url);
    his = await openPage(real.url);
    for (const [{ page, wrongs }, name] of /** @type {const} */ ([
      [hers, "Li Na"],
      [his, "Zhao Lei"],
    ])) {
      await page.goto(`${real.url}/#/live`);
      await page.getByTestId("door").waitFor();
      await signInAt(page, name, PASSWORD);
      wrongs.length = 0;
    }
  });
  after(async () => {
    await hers?.close();
    await his?.close();
    await real?.stop();
  });
  const state = (/** @type {typeof hers} */ { page }) => page.getByTestId("fault-state").textContent();
  const open = async (/** @type {typeof hers} */ { page }, kind = "Anchor bolt") => {
    await page.goto("about:blank");
    await page.goto(`${real.url}/#/faults`);
    await page.getByTestId("faults").getByTestId("fault-card").filter({ hasText: kind }).click();
    await page.getByTestId("fault-details").waitFor();
  };
  const step = (/** @type {typeof hers} */ { page }, /** @type {string} */ to) =>
    page.getByTestId(`step-${to}`).click();

  test("reported by the inspector, it is on the dispatcher's screen at once", async () => {
    await his.page.goto(`${real.url}/#/faults`);
    await his.page.getByTestId("faults").waitFor();
    const { page } = hers;
    await page.goto(`${real.url}/#/me`);
    await becomes(() => page.getByTestId("me-who").inputValue(), lina.id);
    await page.getByTestId("me-fault").locator("summary").click();
    await page.getByTestId("me-fault").locator("select[name=kind]").selectOption("anchor_bolt");
    await page.getByTestId("me-fault").getByText("high").click();
    await page.getByTestId("me-fault").locator("[name=marker]").fill("a17");
    await page.getByTestId("me-fault").locator("[name=text]").fill("two bolts loose");
    await page.getByTestId("me-report").click();
    await page.getByText("Everything has been sent.").waitFor();
    await his.page.getByTestId("fault-card").filter({ hasText: "A17" }).waitFor();
    const [fault] = await owner.get("/faults");
    assert.deepEqual(
      [fault.inspector_id, fault.kind, fault.severity, fault.marker, fault.text, fault.state],
      [lina.id, "anchor_bolt", "high", "A17", "two bolts loose", "open"],
    );
  });

  test("a photo is added and seen; what is none is refused in words", async () => {
    await open(hers);
    const { page } = hers;
    await page
      .getByTestId("photo")
      .setInputFiles({ name: "bolt.png", mimeType: "image/png", buffer: Buffer.from("<svg onload=alert(1)>") });
    await page.getByTestId("fault-details").getByText("not_a_photo").waitFor();
    hers.wrongs.splice(0, Infinity, ...hers.wrongs.filter((w) => !w.includes("422")));
    await page.getByTestId("photo").setInputFiles({ name: "bolt.png", mimeType: "image/png", buffer: PNG });
    const photo = page.getByTestId("photo-shown");
    await photo.waitFor();
    await photo.scrollIntoViewIfNeeded();
    await becomes(() => photo.evaluate((el) => /** @type {HTMLImageElement} */ (el).naturalWidth), 1);
    await page.getByTestId("fault-history").getByText("photo added").waitFor();
  });

  test("acknowledged and sent on by the dispatcher, repaired by the inspector, verified by the dispatcher", async () => {
    await open(his);
    await his.page.locator("#drawer [name=comment]").fill("before Friday");
    await step(his, "acknowledged");
    await becomes(() => state(his), "acknowledged");
    await his.page.locator("#drawer [name=assignee]").selectOption(lina.id);
    await his.page.getByTestId("fault-history").getByText("assigned to 李娜").waitFor();
    // Her screen has followed.
    await open(hers);
    await becomes(() => state(hers), "acknowledged");
    await hers.page.getByTestId("fault-history").getByText("before Friday").waitFor();
    assert.equal(await hers.page.locator("#drawer [name=assignee]").isVisible(), false, "she sends nobody");
    await step(hers, "in_work");
    await becomes(() => state(hers), "in progress");
    await step(hers, "fixed");
    await becomes(() => state(hers), "fixed");
    assert.equal(await hers.page.getByTestId("step-verified").count(), 0, "verifying is the dispatcher's");
    await becomes(() => state(his), "fixed");
    await step(his, "verified");
    await becomes(() => state(his), "verified");
    await his.page.locator("[data-filter=state]").selectOption("verified");
    await becomes(() => his.page.getByTestId("fault-card").count(), 1);
    const [fault] = await owner.get("/faults");
    assert.equal(fault.state, "verified");
    const words = (await owner.get(`/faults/${fault.id}/history`)).map(
      (/** @type {any} */ c) => `${c.changed_by}: ${c.what} ${c.after ?? ""}`,
    );
    assert.deepEqual(
      words.filter((/** @type {string} */ w) => w.includes("state")),
      ["Zhao Lei: state acknowledged", "Li Na: state in_work", "Li Na: state fixed", "Zhao Lei: state verified"],
    );
  });

  test("who is second is told, and what was written stays", async () => {
    const fault = await owner.post("/faults", {
      inspector_id: lina.id,
      kind: "drainage",
      severity: "low",
      marker: "A17",
    });
    await open(his, "Drainage");
    await his.page.locator("#drawer [name=comment]").fill("my words");
    // Behind the feed's back: the page is asked for its step with the version that it has seen.
    await his.page.route(
      "**/api/v1/faults/*",
      async (route) => {
        if (route.request().method() === "PATCH")
          await owner.patch(`/faults/${fault.id}`, { state: "acknowledged", version: fault.version });
        await route.continue();
      },
      { times: 1 },
    );
    await step(his, "in_work");
    await his.page.getByTestId("fault-details").getByText("fault_changed").waitFor();
    await becomes(() => state(his), "acknowledged");
    assert.equal(await his.page.locator("#drawer [name=comment]").inputValue(), "my words");
    his.wrongs.splice(0, Infinity, ...his.wrongs.filter((w) => !w.includes("409")));
  });

  test("nothing went wrong", () => {
    assert.deepEqual(hers.wrongs, []);
    assert.deepEqual(his.wrongs, []);
  });
});
