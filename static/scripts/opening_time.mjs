// How long it takes until a session's track and charts are on the screen, in a headless browser:
// `LODESTEP_URL=http://127.0.0.1:8080 npm run opening-time -- SESSION`. Prints the times of five openings, the page
// itself loaded before, and how many points and chart values were drawn.

import { openPage } from "../tests/browser/chrome.mjs";

const url = process.env.LODESTEP_URL ?? "http://127.0.0.1:8080";
const [session] = process.argv.slice(2);
if (!session) throw new Error("expected a session's id: npm run opening-time -- SESSION");

const tab = await openPage(url);
/** @type {{track_ms: number, charts_ms: number}[]} */
const times = [];
try {
  const { page } = tab;
  for (let k = 0; k < 5; k++) {
    await page.goto(`${url}/#/sessions`);
    await page.reload();
    await page.locator("html[data-ready=yes]").waitFor();
    await page.getByTestId("session-card").first().waitFor();
    const time = await page.evaluate(async (id) => {
      const began = performance.now();
      location.hash = `#/sessions/${id}`;
      // Two frames after the sign is set, what it stands for has been painted.
      const shown = (/** @type {string} */ sign) =>
        new Promise((/** @type {(ms: number) => void} */ resolve) => {
          const look = () => {
            if (document.querySelector(sign))
              requestAnimationFrame(() => requestAnimationFrame(() => resolve(performance.now() - began)));
            else requestAnimationFrame(look);
          };
          look();
        });
      const [track_ms, charts_ms] = await Promise.all([shown("[data-drawn=yes]"), shown("[data-charted=yes]")]);
      return { track_ms, charts_ms };
    }, session);
    times.push(time);
  }
  for (const { track_ms, charts_ms } of times)
    console.log(`track ${track_ms.toFixed(0)} ms, charts ${charts_ms.toFixed(0)} ms`);
  const middle = (/** @type {number[]} */ values) => values.sort((a, b) => a - b)[values.length >> 1].toFixed(0);
  console.log(
    `in the middle: track ${middle(times.map((t) => t.track_ms))} ms, charts ${middle(times.map((t) => t.charts_ms))} ms`,
  );
  if (tab.wrongs.length > 0) console.log(tab.wrongs.join("\n"));
} finally {
  await tab.close();
}
