// Takes the pictures of every screen from a running demo: `LODESTEP_URL=http://127.0.0.1:8080 npm run screenshot`.
// The README's own is docs/screenshot.png; the others are in docs/screens/, and docs/screens.md shows them.

import { mkdir, stat } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "../tests/browser/chrome.mjs";

const MOST_BYTES = 300_000;
const url = process.env.LODESTEP_URL ?? "http://127.0.0.1:8080";
const docs = fileURLToPath(new URL("../../docs/", import.meta.url));
await mkdir(`${docs}screens`, { recursive: true });

const tab = await openPage(url, { viewport: { width: 1280, height: 740 }, colorScheme: "light" });
const { page } = tab;
let wrong = 0;

/**
 * @param {string} name
 * @param {string} hash
 * @param {string} sign what is there when the screen is
 * @param {() => Promise<void>} [before] what is done first
 */
async function take(name, hash, sign, before) {
  await page.goto(`${url}/${hash}`);
  await page.locator(sign).first().waitFor({ timeout: 60_000 });
  await before?.();
  const path = `${docs}${name}.png`;
  await page.screenshot({ path, animations: "disabled" });
  const { size } = await stat(path);
  console.log(`docs/${name}.png: ${(size / 1000).toFixed(0)} kB`);
  if (size > MOST_BYTES) {
    console.error(`expected at most ${MOST_BYTES / 1000} kB`);
    wrong += 1;
  }
}

/** @param {string} path */
const get = async (path) => (await fetch(`${url}/api/v1${path}`)).json();

try {
  await take("screenshot", "#/live", "[data-testid=inspector-row][data-east-m]", async () => {
    // Trails are worth a look once somebody has walked a little.
    await page.waitForFunction(() => [...document.querySelectorAll("[data-inspector] .since-m")].some((el) => parseFloat(el.textContent ?? "") > 20), undefined, { timeout: 90_000 });
    await page.locator("[data-testid=inspector-row][data-east-m]").first().click();
    await page.locator("#fit").click();
    await page.getByTestId("drawer").waitFor();
  });
  await take("screens/sessions", "#/sessions", "[data-testid=session-card]");
  const finished = (await get("/sessions?state=finished"))[0];
  if (finished) {
    await take("screens/replay", `#/sessions/${finished.id}?t=40`, "[data-testid=session][data-drawn=yes]", () => page.locator("[data-charted=yes]").first().waitFor());
    await take("screens/quality", `#/sessions/${finished.id}`, "[data-testid=session][data-drawn=yes]", () => page.locator("[data-tab=quality]").click());
  }
  await take("screens/upload", "#/upload", "[data-testid=drop]");
  await take("screens/faults", "#/faults", "[data-testid=fault-card]", () => page.locator("[data-testid=fault-card]").first().click());
  await take("screens/markers", "#/markers", "[data-testid=markers] td");
  await take("screens/inspector", "#/me", "[data-testid=me]");
  await take("screens/account", "#/account", "[data-testid=set-up]");
  await take("screens/server", "#/admin/server", ".figures div");
  await take("screens/changes", "#/admin/audit", "[data-testid=audit] td");
  await take("screens/api", "#/api", "[data-testid=routes] details");
  // The dark room.
  await page.emulateMedia({ colorScheme: "dark" });
  await take("screens/live-dark", "#/live", "[data-testid=inspector-row][data-east-m]", () => page.locator("#fit").click());
} finally {
  await tab.close();
}
process.exit(wrong === 0 ? 0 : 1);
