// Takes the pictures of every screen from a running demo: `LODESTEP_URL=http://127.0.0.1:8080 npm run screenshot`.
// The README's own is docs/screenshot.png; the others are in docs/screens/, and docs/screens.md shows them.

import { once } from "node:events";
import { mkdir, stat } from "node:fs/promises";
import { createServer } from "node:http";
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

/**
 * @param {string} path
 * @param {string} [method]
 * @param {unknown} [body]
 */
async function ask(path, method = "GET", body) {
  const sent =
    body === undefined ? {} : { headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
  const answer = await fetch(`${url}/api/v1${path}`, { method, ...sent });
  const told = await answer.json();
  if (!answer.ok) throw new Error(`${method} ${path}: ${told.detail}`);
  return told;
}

/**
 * A set of parameters that is the site's, and the walk worked out with another beside its own track.
 * @param {string} session_id
 */
async function workInTheLab(session_id) {
  const set = await ask("/lab/parameter-sets", "POST", {
    name: "Firm markers",
    about: "Markers are believed to a hand's breadth",
    parameters: { marker_sigma_m: 0.1 },
  });
  await ask("/lab/site-parameters", "PUT", { parameter_set_id: set.id, version: set.version });
  const runs = await ask("/lab/runs", "POST", { session_ids: [session_id], parameter_set_id: set.id });
  runs.push(
    ...(await ask("/lab/runs", "POST", {
      session_ids: [session_id],
      name: "Compass alone",
      aids: ["zupt", "heading"],
    })),
  );
  for (const run of runs) {
    while (["queued", "running"].includes((await ask(`/lab/runs/${run.id}`)).state))
      await new Promise((resolve) => setTimeout(resolve, 500));
  }
  return set;
}

/** A program that is told of everything and answers, and one that is away. */
async function registerWebhooks() {
  const receiver = createServer((request, response) =>
    request.resume().on("end", () => response.writeHead(200).end("ticket opened")),
  ).listen(0, "127.0.0.1");
  await once(receiver, "listening");
  const { port } = /** @type {import("node:net").AddressInfo} */ (receiver.address());
  const events = ["fault.reported", "fault.changed", "anomalies.found"];
  const tickets = await ask("/webhooks", "POST", { name: "Tickets", url: `http://127.0.0.1:${port}/lodestep`, events });
  const pager = await ask("/webhooks", "POST", {
    name: "Pager",
    url: "http://127.0.0.1:9/alarm",
    events: events.slice(0, 1),
  });
  for (const hook of [tickets, pager]) await ask(`/webhooks/${hook.id}/test`, "POST");
  return { receiver, tickets };
}

try {
  await take("screenshot", "#/live", "[data-testid=inspector-row][data-east-m]", async () => {
    // Trails are worth a look once somebody has walked a little.
    await page.waitForFunction(
      () =>
        [...document.querySelectorAll("[data-inspector] .since-m")].some((el) => parseFloat(el.textContent ?? "") > 20),
      undefined,
      { timeout: 90_000 },
    );
    await page.locator("[data-testid=inspector-row][data-east-m]").first().click();
    await page.locator("#fit").click();
    await page.getByTestId("drawer").waitFor();
  });
  await take("screens/sessions", "#/sessions", "[data-testid=session-card]");
  const finished = (await ask("/sessions?state=finished"))[0];
  if (finished) {
    await take("screens/replay", `#/sessions/${finished.id}?t=40`, "[data-testid=session][data-drawn=yes]", () =>
      page.locator("[data-charted=yes]").first().waitFor(),
    );
    await take("screens/quality", `#/sessions/${finished.id}`, "[data-testid=session][data-drawn=yes]", () =>
      page.locator("[data-tab=quality]").click(),
    );
  }
  if (finished) {
    const set = await workInTheLab(finished.id);
    await take("screens/lab", `#/lab?walks=${finished.id}`, "[data-testid=comparison] [data-remove-run]", async () => {
      await page.locator("[name=set]").selectOption(set.id);
      await page.evaluate(() => scrollTo(0, 0));
    });
    await take(
      "screens/lab-comparison",
      `#/lab?walks=${finished.id}`,
      "[data-testid=comparison] [data-remove-run]",
      () => page.locator(".results").scrollIntoViewIfNeeded(),
    );
  }
  await take("screens/upload", "#/upload", "[data-testid=drop]");
  await take("screens/faults", "#/faults", "[data-testid=fault-card]", () =>
    page.locator("[data-testid=fault-card]").first().click(),
  );
  await take("screens/markers", "#/markers", "[data-testid=markers] td");
  await take("screens/inspector", "#/me", "[data-testid=me]");
  await take("screens/account", "#/account", "[data-testid=set-up]");
  await take("screens/server", "#/admin/server", ".figures div");
  await take("screens/changes", "#/admin/audit", "[data-testid=audit] td");
  const { receiver, tickets } = await registerWebhooks();
  await take("screens/webhooks", "#/admin/webhooks", "[data-testid=webhooks] tbody tr", async () => {
    await page.locator(`[data-webhook="${tickets.id}"] [data-do=deliveries]`).click();
    await page.locator("[data-testid=deliveries] .tag.good").first().waitFor();
    await page.locator("[data-testid=webhooks] .tag.warn").first().waitFor();
  });
  receiver.close();
  await take("screens/api", "#/api", "[data-testid=routes] details");
  // The dark room.
  await page.emulateMedia({ colorScheme: "dark" });
  await take("screens/live-dark", "#/live", "[data-testid=inspector-row][data-east-m]", () =>
    page.locator("#fit").click(),
  );
} finally {
  await tab.close();
}
process.exit(wrong === 0 ? 0 : 1);
