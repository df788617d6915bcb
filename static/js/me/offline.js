// Keeps the page for a reload without a link. Browsers allow that only where the page is served securely, or
// from the machine itself; elsewhere the page has to stay open, and says so.

/**
 * Has the browser keep what this page is made of.
 * @returns {Promise<boolean>} whether it will
 */
export async function keepShell() {
  if (!("serviceWorker" in navigator)) return false;
  try {
    await navigator.serviceWorker.register("/sw.js");
    const { active } = await navigator.serviceWorker.ready;
    const loaded = performance
      .getEntriesByType("resource")
      .map((entry) => new URL(entry.name).pathname + new URL(entry.name).search);
    active?.postMessage({ type: "keep", paths: ["/", ...loaded] });
    return active !== null;
  } catch {
    return false;
  }
}
