// Can everybody use it? axe-core looks at every screen, in both languages and both themes.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { startMock } from "../mock-server.mjs";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;
const AXE = fileURLToPath(import.meta.resolve("axe-core/axe.min.js"));

describe("every screen can be read and used", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {string} */
  let axe;

  before(async () => {
    mock = await startMock();
    axe = await readFile(AXE, "utf8");
  });
  after(() => mock?.stop());

  for (const [theme, locale] of /** @type {const} */ ([
    ["light", "en"],
    ["dark", "zh-CN"],
  ])) {
    test(`${theme}, ${locale}`, async () => {
      const tab = await openPage(mock.url, { colorScheme: theme, locale });
      try {
        const { page } = tab;
        /** @type {string[]} */
        const wrongs = [];
        const look = async (/** @type {string} */ where) => {
          const found = await page.evaluate(
            async (/** @type {any} */ options) => {
              const { violations } = await /** @type {any} */ (window).axe.run(document, options);
              return violations.map(
                (/** @type {any} */ v) =>
                  `${v.id} (${v.impact}): ${v.nodes
                    .slice(0, 3)
                    .map((/** @type {any} */ n) => `${n.target} ${n.any[0]?.message ?? ""}`)
                    .join(" | ")}`,
              );
            },
            { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"] },
          );
          wrongs.push(...found.map((/** @type {string} */ words) => `${where}: ${words}`));
        };
        const screens = [
          "#/live",
          "#/sessions",
          "#/sessions/s9",
          "#/upload",
          "#/faults",
          "#/markers",
          "#/me",
          "#/account",
          "#/admin",
          "#/admin/tokens",
          "#/admin/audit",
          "#/admin/server",
          "#/admin/webhooks",
          "#/api",
          "#/lab?walks=s9",
        ];
        const signs = [
          ".person-row",
          "[data-testid=session-card]",
          "[data-drawn=yes]",
          "[data-testid=drop]",
          "[data-testid=fault-card]",
          "[data-testid=markers] td",
          "[data-testid=me]",
          "[data-testid=set-up]",
          "[data-testid=admin-accounts] p",
          "[data-testid=tokens] td",
          "[data-testid=audit] td",
          ".figures div",
          ".new-webhook",
          "[data-testid=routes] details",
          "[data-testid=comparison] td",
        ];
        for (const [i, screen] of screens.entries()) {
          await page.goto(`${mock.url}/${screen}`);
          await page.locator(signs[i]).first().waitFor();
          await page.evaluate(axe);
          await look(screen);
        }
        await page.goto(`${mock.url}/#/upload`);
        await page.getByTestId("files").setInputFiles([
          { name: "left.csv", mimeType: "text/csv", buffer: Buffer.from("t_s,gyr_x_rad_s\n0,1\n") },
          { name: "right.csv", mimeType: "text/csv", buffer: Buffer.from("secs,wx,wy,wz,fx,fy,fz\n0,1,2,3,0,0,9.8\n") },
        ]);
        await page.getByTestId("mapping").waitFor();
        await page.getByTestId("preview-left").locator("summary").first().click();
        await page.evaluate(axe);
        await look("logs looked at");
        await page.goto(`${mock.url}/#/sessions/s9?t=300&with=s8`);
        await page.locator("[data-charted=yes]").waitFor();
        for (const part of ["replay", "quality", "markers", "files"]) {
          await page.locator(`[data-tab=${part}]`).click();
          if (part === "replay") await page.locator("summary").first().click();
          await look(`a walk's ${part}`);
        }
        await page.goto(`${mock.url}/#/live`);
        await page.locator(".person-row").first().click();
        await page.getByTestId("drawer").waitFor();
        await look("the details of a person");
        await page.getByTestId("report-fault").click();
        await page.getByTestId("dialog-fault").waitFor();
        await look("the fault form");
        await page.goto(`${mock.url}/#/faults`);
        await page.getByTestId("fault-card").first().click();
        await page.getByTestId("helper").first().waitFor();
        await page.getByTestId("edit-fault").locator("summary").click();
        await look("the details of a fault");
        await page.goto(`${mock.url}/#/markers`);
        await page.locator('[data-marker="A17"]').click();
        await page.getByTestId("history").locator("p").waitFor();
        await look("the details of a marker");
        await page.locator("[data-do=edit]").click();
        await page.getByTestId("drag").click();
        await look("a marker that is edited");
        await page.locator("[data-do=cancel]").click();
        await page.getByTestId("import-markers").click();
        await page.locator(".wizard h3").first().waitFor();
        const file = {
          name: "survey.csv",
          mimeType: "text/csv",
          buffer: Buffer.from("name,e_m,n_m,u_m\nA1,1,2,3\nA2,4,5,6\nA3,7,8,9\nZ1,9,9,9\n"),
        };
        await page.getByTestId("markers-file").setInputFiles(file);
        await page.getByTestId("findings").locator("li").first().waitFor();
        await look("a file of markers");
        mock.staff.close();
        await page.goto("about:blank");
        await page.goto(`${mock.url}/#/admin`);
        await page.getByTestId("door").waitFor();
        await page.evaluate(axe);
        await look("the door");
        await page.locator("[data-testid=door] [name=name]").fill("Chen Wei");
        await page.locator("[data-testid=door] [name=password]").fill("a good sentence");
        await page.keyboard.press("Enter");
        await page.getByTestId("accounts").waitFor();
        await look("accounts");
        await page.goto(`${mock.url}/#/account`);
        await page.getByTestId("password").waitFor();
        await look("one's own account");
        mock.staff.open();
        assert.deepEqual(wrongs, []);
      } finally {
        await tab.close();
      }
    });
  }
});
