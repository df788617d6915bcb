// Keeps the page for a reload without a link. Browsers allow that only where the page is served securely, or
// from the machine itself; elsewhere the page has to stay open, and says so.

/** What the page asks for before it can be used; some of it may still be on its way. */
const TABLES = ["account", "site", "site/plan", "systems", "inspectors", "markers"].map((name) => `/api/v1/${name}`);
/** A link that takes longer for the whole page does not keep it, ms. */
const PATIENCE_MS = 60_000;

/**
 * Has the browser keep what this page is made of.
 * @returns {Promise<boolean>} whether all of it is kept now
 */
export async function keepShell() {
  if (!("serviceWorker" in navigator)) return false;
  try {
    await navigator.serviceWorker.register("/sw.js");
    const { active } = await navigator.serviceWorker.ready;
    if (active === null) return false;
    const { port1: near, port2: far } = new MessageChannel();
    const answer = new Promise((resolve) => {
      near.onmessage = ({ data }) => resolve(data.kept);
      setTimeout(() => resolve(false), PATIENCE_MS);
    });
    active.postMessage({ type: "keep", paths: [...new Set(["/", ...TABLES, ...named(), ...loaded()])] }, [far]);
    return await answer;
  } catch {
    return false;
  }
}

/** What the document names: a module that it brings ahead of its use is not always among what was loaded. */
const named = () =>
  [...document.querySelectorAll("link[href], script[src]")].map((one) =>
    path(one instanceof HTMLLinkElement ? one.href : /** @type {HTMLScriptElement} */ (one).src),
  );

/** What was fetched for the screens that have been open. */
const loaded = () =>
  performance
    .getEntriesByType("resource")
    .map(({ name }) => path(name))
    // A question about one thing is asked anew, whether or not there is a link.
    .filter((one) => !one.startsWith("/api/"));

/** @param {string} address */
function path(address) {
  const { pathname, search } = new URL(address);
  return pathname + search;
}
