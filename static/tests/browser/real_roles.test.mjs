// Each role on a real server: what it may is there, and what it may not is not offered, or is said.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { findServer, HOW_TO_GET_SERVER, signInAt, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;
const PASSWORD = "a sentence nobody says";
/** What each role is offered; an inspector of walks is tied to 李娜, a second one to nobody. */
const ROLES = {
  viewer: { walks: false, dispatches: false, surveys: false, administers: false },
  inspector: { walks: true, dispatches: false, surveys: false, administers: false },
  dispatcher: { walks: true, dispatches: true, surveys: false, administers: false },
  surveyor: { walks: false, dispatches: false, surveys: true, administers: false },
  engineer: { walks: true, dispatches: false, surveys: false, administers: false },
  admin: { walks: true, dispatches: true, surveys: true, administers: true },
};

describe("each role, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {ReturnType<typeof real.as>} */
  let owner;
  /** @type {Record<string, any>} */
  const made = {};

  before(async () => {
    real = await startReal();
    await real.post("/markers/import", "name,e_m,n_m,u_m\nA17,10,20,0\nA18,14,20,0\n", { "Content-Type": "text/csv" });
    made.lina = await real.post("/inspectors", { name: "李娜" });
    made.petr = await real.post("/inspectors", { name: "Novák, Petr" });
    for (const inspector of [made.lina, made.petr]) {
      const session = await real.post("/sessions", { inspector_id: inspector.id, start: { marker: "A17" } });
      await real.handIn(session.id, await real.walk("line:20"));
      await real.process(session.id);
      made[inspector.name] = session.id;
      await real.post("/faults", { inspector_id: inspector.id, kind: "drainage", severity: "low", marker: "A17" });
    }
    owner = await real.setUp("Wang Fang", PASSWORD);
    for (const role of Object.keys(ROLES)) {
      await owner.post("/accounts", {
        name: `a ${role}`,
        password: PASSWORD,
        role,
        ...(role === "inspector" ? { inspector_id: made.lina.id } : {}),
      });
    }
    await owner.post("/accounts", { name: "a lone inspector", password: PASSWORD, role: "inspector" });
  });
  after(() => real?.stop());

  /** @param {string} name @param {(page: import("playwright-core").Page) => Promise<void>} look */
  async function signedIn(name, look) {
    const tab = await openPage(real.url);
    try {
      await tab.page.goto(`${real.url}/#/live`);
      await tab.page.getByTestId("door").waitFor();
      await signInAt(tab.page, name, PASSWORD);
      tab.wrongs.splice(0, Infinity, ...tab.wrongs.filter((w) => !w.includes("401")));
      await look(tab.page);
      // Nothing that was offered was refused.
      assert.deepEqual(tab.wrongs, []);
    } finally {
      await tab.close();
    }
  }

  for (const [role, may] of Object.entries(ROLES)) {
    test(`${role}`, { timeout: 120_000 }, () =>
      signedIn(`a ${role}`, async (page) => {
        const visit = async (/** @type {string} */ hash, /** @type {string} */ sign) => {
          await page.goto(`${real.url}/${hash}`);
          await page.locator(sign).first().waitFor();
        };
        const seen = (/** @type {string} */ selector) => page.locator(selector).first().isVisible();
        const places = await page
          .locator("nav [data-route]:visible")
          .evaluateAll((links) => links.map((el) => el.getAttribute("data-route")));
        const expected = may.walks
          ? ["live", "sessions", "upload", "me", "faults", "markers"]
          : ["live", "sessions", "faults", "markers"];
        if (role === "engineer" || role === "admin") expected.push("lab");
        if (may.administers) expected.push("admin");
        assert.deepEqual(places, expected);

        await visit("#/upload", "[data-testid=drop]");
        assert.equal(await seen("[data-testid=may-not]"), !may.walks);
        if (may.walks) {
          await page.locator("select[name=inspector] option", { hasText: "李娜" }).waitFor({ state: "attached" });
          const names = await page.locator("select[name=inspector] option").allTextContents();
          assert.equal(names.includes("Novák, Petr"), role !== "inspector");
          assert.equal(names.includes("New inspector …"), may.dispatches, String(names));
        }
        await visit("#/me", "[data-testid=me]");
        assert.equal(await seen("[data-testid=may-not]"), !may.walks);

        await visit("#/markers", "[data-testid=markers] td");
        assert.equal(await seen("[data-action=add]"), may.surveys);
        assert.equal(await seen("[data-testid=import-markers]"), may.surveys);
        await page.locator('[data-marker="A17"]').click();
        await page.getByTestId("history").waitFor();
        assert.equal(await seen("[data-do=edit]"), may.surveys);

        await visit("#/faults", "[data-testid=fault-card]");
        await page.getByTestId("fault-card").first().click();
        await page.getByTestId("fault-history").locator("li").first().waitFor();
        assert.equal(await seen("[data-testid=step-acknowledged]"), may.walks);
        assert.equal(await seen("#drawer [name=assignee]"), may.dispatches);
        assert.equal(await seen("[data-testid=photo]"), may.walks);

        for (const name of ["李娜", "Novák, Petr"]) {
          await visit(`#/sessions/${made[name]}`, "[data-testid=session][data-drawn=yes]");
          await page.locator("[data-tab=markers]").click();
          const writes = may.walks && (role !== "inspector" || name === "李娜");
          assert.equal(await page.locator("[name=automatic]").isEnabled(), writes, `automatic mode of ${name}'s walk`);
        }
        await visit("#/live", "[data-testid=inspector-row]");
        for (const name of ["李娜", "Novák, Petr"]) {
          await page.locator("[data-inspector]", { hasText: name }).click();
          await page.locator("#drawer h2", { hasText: name }).waitFor();
          assert.equal(
            await seen("[data-testid=report-fault]"),
            may.walks && (role !== "inspector" || name === "李娜"),
            `a report for ${name}`,
          );
        }

        await visit("#/account", "[data-testid=password]");
        assert.equal(await seen(".page a[href='#/admin']"), may.administers);
        await visit("#/admin/audit", may.administers ? "[data-testid=audit] td" : "[data-testid=may-not]");
      }),
    );
  }

  test("an inspector's account that belongs to no inspector is told what it lacks", () =>
    signedIn("a lone inspector", async (page) => {
      for (const hash of ["#/upload", "#/me"]) {
        await page.goto(`${real.url}/${hash}`);
        await page.getByTestId("may-not").getByText("not linked to an inspector").waitFor();
      }
    }));
});
