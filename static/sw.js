// Lets the inspector's page be opened without a link: files and the few tables that it starts with are answered
// by the server while it can be reached, and from what was kept when it cannot. Nothing that changes something
// and nothing of a walk goes through here.

const CACHE = "lodestep";
/** What the page asks for before it can be used. */
const TABLES = /^\/api\/v1\/(account|site|site\/plan|systems|inspectors|markers)$/;
/** Who comes or goes takes nothing of the one before along. */
const SIGNS = /^\/api\/v1\/account\/sign-(in|out)$/;
/** A server that takes longer is as good as none, ms. */
const PATIENCE_MS = 5000;

self.addEventListener("install", () => self.skipWaiting());
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));

self.addEventListener("message", (event) => {
  if (event.data?.type !== "keep") return;
  const all = Promise.all(event.data.paths.filter(kept).map(keep));
  event.waitUntil(all.then((done) => event.ports[0]?.postMessage({ kept: done.every(Boolean) })));
});

/**
 * @param {string} path
 * @returns {Promise<boolean>} whether it can be answered without a link from now on
 */
async function keep(path) {
  const cache = await caches.open(CACHE);
  if (await cache.match(path)) return true;
  try {
    const response = await fetch(path);
    if (response.ok) await cache.put(path, response);
    // What this account may not see, its page does without.
    return response.ok || response.status === 403;
  } catch {
    return false;
  }
}

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const url = new URL(request.url);
  if (SIGNS.test(url.pathname)) event.waitUntil(caches.delete(CACHE));
  if (request.method !== "GET" || url.origin !== self.location.origin || !kept(url.pathname)) return;
  event.respondWith(answer(request));
});

/** @param {string} path */
function kept(path) {
  return path.startsWith("/api/") ? TABLES.test(path) : !/^\/(healthz|metrics)/.test(path);
}

/** @param {Request} request */
async function answer(request) {
  const cache = await caches.open(CACHE);
  const known = await cache.match(request, { ignoreSearch: request.mode === "navigate" });
  const asked = fetch(request).then((response) => {
    if (response.ok) cache.put(request, response.clone()).catch(() => undefined);
    return response;
  });
  if (!known) return asked;
  const patience = new Promise((resolve) => setTimeout(() => resolve(known), PATIENCE_MS));
  return Promise.race([asked.catch(() => known), patience]);
}
