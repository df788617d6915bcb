// Takes the README's picture from a running demo: `LODESTEP_URL=http://127.0.0.1:8080 npm run screenshot`.

import { stat } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "../tests/browser/chrome.mjs";

const MOST_BYTES = 300_000;
const url = process.env.LODESTEP_URL ?? "http://127.0.0.1:8080";
const path = fileURLToPath(new URL("../../docs/screenshot.png", import.meta.url));

const tab = await openPage(url, { viewport: { width: 1280, height: 740 }, colorScheme: "light" });
try {
  const { page } = tab;
  await page.goto(`${url}/#/live`);
  const first = page.locator("[data-testid=inspector-row][data-east-m]").first();
  await first.waitFor({ timeout: 60_000 });
  // Trails are worth a look once somebody has walked a little.
  await page.waitForFunction(() => [...document.querySelectorAll("[data-inspector] .since-m")].some((el) => parseFloat(el.textContent ?? "") > 20), undefined, { timeout: 90_000 });
  await first.click();
  await page.locator("#fit").click();
  await page.getByTestId("drawer").waitFor();
  await page.screenshot({ path, animations: "disabled" });
} finally {
  await tab.close();
}
const { size } = await stat(path);
console.log(`docs/screenshot.png: ${(size / 1000).toFixed(0)} kB`);
if (size > MOST_BYTES) {
  console.error(`expected at most ${MOST_BYTES / 1000} kB`);
  process.exit(1);
}
