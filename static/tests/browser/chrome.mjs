// Starts an installed Chromium or Chrome for a test, and watches what the page does: errors, reports of the
// content security policy, and requests to any other host, which are blocked.

import assert from "node:assert/strict";
import { access } from "node:fs/promises";
import { chromium } from "playwright-core";

const PLACES = [
  process.env.CHROME,
  "/usr/bin/chromium",
  "/usr/bin/chromium-browser",
  "/usr/bin/google-chrome",
  "/usr/bin/google-chrome-stable",
  "/opt/google/chrome/chrome",
  "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
];

/** @returns {Promise<string | null>} */
export async function findChrome() {
  for (const place of PLACES) {
    if (
      place &&
      (await access(place).then(
        () => true,
        () => false,
      ))
    )
      return place;
  }
  return null;
}

export const HOW_TO_GET_CHROME =
  "no Chromium or Chrome found: install the package `chromium`, or name the program in CHROME";

export async function launchChrome() {
  const executablePath = await findChrome();
  if (!executablePath) throw new Error(HOW_TO_GET_CHROME);
  return chromium.launch({
    executablePath,
    args: [
      "--headless",
      "--no-sandbox",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
    ],
  });
}

/**
 * @param {string} url where the page is served
 * @param {import("playwright-core").BrowserContextOptions} [options]
 */
export async function openPage(url, options = {}) {
  const browser = await launchChrome();
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, locale: "en-GB", ...options });
  const page = await context.newPage();
  /** @type {string[]} */
  const wrongs = [];
  const origin = new URL(url).origin;
  await context.route(
    (asked) => asked.origin !== origin,
    (route) => {
      wrongs.push(`request to another host: ${route.request().url()}`);
      return route.abort();
    },
  );
  page.on("console", (message) => {
    if (message.type() === "error") wrongs.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => wrongs.push(`error: ${error.stack ?? error.message}`));
  await page.addInitScript(() => {
    document.addEventListener("securitypolicyviolation", (event) => {
      console.error(`policy: ${event.violatedDirective} ${event.blockedURI} ${event.sourceFile}:${event.lineNumber}`);
    });
  });
  return { page, context, wrongs, close: () => browser.close() };
}

/**
 * Waits until what is read from the page is what is expected: a page shows a change in its next frame, which on a busy
 * machine is any time after the key or the message that asked for it.
 *
 * @template T
 * @param {() => Promise<T>} read
 * @param {T} expected
 */
export async function becomes(read, expected, longest_ms = 30_000) {
  const end = Date.now() + longest_ms;
  for (;;) {
    const found = await read();
    if (found === expected || Date.now() > end) {
      assert.equal(found, expected);
      return;
    }
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}
