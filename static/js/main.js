// Starts the page: words, theme, site, map, feed; then each thing that changes is shown once a frame.

import { throughTheDoor, watchForTheEnd } from "./account/door.js";
import * as api from "./api.js";
import { makeApp } from "./app.js";
import { Feed } from "./feed.js";
import { one, setAttribute, setText } from "./html.js";
import { currentLanguage, loadLanguage, pickLanguage, t, translate } from "./i18n.js";
import { apply, emptyState } from "./state/live.js";
import { forgetInk } from "./map/ink.js";
import { FIRST, learnSystems, loadSystem } from "./systems/index.js";
import { makeAlarms } from "./ui/alarms.js";
import { chosenAddress, readChosen } from "./ui/chosen.js";
import { makeHelp } from "./ui/help.js";
import { makeGoTo } from "./ui/go_to.js";
import { makeKeyboard } from "./ui/keyboard.js";
import { makeLinkState } from "./ui/link.js";
import { makeMapTools } from "./ui/map_tools.js";
import { makeRouter, readRoute } from "./ui/router.js";
import { chosenTheme, showTheme, toggleTheme } from "./ui/theme.js";
import * as store from "./ui/remembered.js";

showTheme(chosenTheme());
/** Asked for side by side with who is there: each question that waits for the one before makes the page late by a round trip. */
const system = loadSystem(FIRST);
const words = loadLanguage(pickLanguage(navigator.languages, store.recall("language")));
/** The feed's first snapshot says which markers there are; without one, in so many ms, those that can be had are asked for. */
const WAIT_FOR_SNAPSHOT_MS = 2000;

const app = await start();

async function start() {
  const [me] = await Promise.all([fetchUntilThere(() => throughTheDoor(words)), words, system]);
  watchForTheEnd();
  // The feed is opened while the site is asked for: what it tells first is the longest answer of all.
  const live = emptyState();
  let linkUp = false;
  /** @type {import("./app.js").App | null} */
  let shownBy = null;
  const feed = new Feed({
    makeSocket: () => new WebSocket(api.feedUrl()),
    resume: () => (live.boot === null ? null : { since: live.seq, boot: live.boot }),
    onMessage(message) {
      if (message.type === "error" && message.code === "not_signed_in") dispatchEvent(new Event("signed-out"));
      const { gap, changed } = apply(live, message, Date.now());
      shownBy?.changed(...changed);
      return { gap };
    },
    onLink(up) {
      linkUp = up;
      shownBy?.changed("link");
    },
  });
  feed.open();
  // Until it is known, sessions of a system that the page has no file for have a point and a trail.
  learnSystems(api).then(() => shownBy?.changed("all"));
  const [site, plan] = await fetchUntilThere(() => Promise.all([api.site(), api.sitePlan()]));
  const app = (shownBy = makeApp(site, plan, me, live));
  readChosen(app, location.hash);
  one("#account").hidden = false;
  // Who hands in no walks is not led there.
  for (const route of ["upload", "me"]) one(`nav [data-route=${route}]`).hidden = !app.may("walk");
  one("[data-route=admin]").hidden = !app.may("administer");
  one("[data-route=lab]").hidden = !app.may("engineer");
  const link = makeLinkState(app, () => linkUp);
  const router = makeRouter(app);
  const alarms = makeAlarms(app);
  const tools = makeMapTools(app);

  app.onFrame((changed) => {
    link.update();
    tools.update();
    const told = app.live.boot !== null || performance.now() > openedAt + WAIT_FOR_SNAPSHOT_MS;
    const address = changed.has("choice") ? chosenAddress(app, readRoute(location.hash).screen) : null;
    if (address !== null && address !== (location.hash || "#/live")) history.replaceState(null, "", address);
    if (told && (changed.has("markers") || app.live.markers_revision !== markersRevision)) fetchMarkers();
    app.layers.update(changed, router.name());
    router.view()?.update?.(changed);
    alarms.update();
  });

  const openedAt = performance.now();
  /** The markers that the map shows are of this revision. */
  let markersRevision = -1;
  function fetchMarkers() {
    markersRevision = app.live.markers_revision;
    api.markers().then(app.setMarkers, () => {
      // Asked for again with the next change or connection; the plan's own places stand in until then.
      markersRevision = -1;
    });
  }

  // Try at once when there is reason to hope; a page in the background has its timers slowed.
  addEventListener("online", () => feed.open());
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) feed.open();
  });

  // People age and the clock goes on without any message.
  setInterval(() => app.changed("tick"), 1000);

  const help = makeHelp();
  const goTo = makeGoTo(app);
  makeKeyboard(app, { help, goTo });
  one("#help").addEventListener("click", () => help.show());
  one("#go").addEventListener("click", () => goTo.show());
  one("#theme").addEventListener("click", () => {
    toggleTheme();
    forgetInk();
    app.layers.repaint();
    app.changed("all");
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    showTheme(chosenTheme());
    forgetInk();
    app.layers.repaint();
  });
  one("#language").addEventListener("click", async () => {
    const next = currentLanguage() === "en" ? "zh-CN" : "en";
    store.remember("language", next);
    await loadLanguage(next);
    showWords();
    router.again();
    app.changed("all");
  });
  showWords();
  await router.go();
  document.documentElement.dataset.ready = "yes";
  return app;

  function showWords() {
    document.documentElement.lang = currentLanguage();
    translate(document);
    setText(one("#language"), currentLanguage() === "en" ? "中文" : "English");
    setText(one("#account span"), app.me.name ?? t("nav.account"));
    setAttribute(one("#language"), "lang", currentLanguage() === "en" ? "zh-CN" : "en");
  }
}

/**
 * The page may be opened while the server is still starting.
 * @template T
 * @param {() => Promise<T>} fetchThem
 * @returns {Promise<T>}
 */
async function fetchUntilThere(fetchThem) {
  const banner = one("#banner");
  for (let wait_ms = 500; ; wait_ms = Math.min(8000, wait_ms * 2)) {
    try {
      const found = await fetchThem();
      banner.hidden = true;
      return found;
    } catch (error) {
      await words.catch(() => undefined);
      banner.hidden = false;
      setText(banner, t("link.no_server", { reason: error instanceof Error ? error.message : String(error) }));
      await new Promise((resolve) => setTimeout(resolve, wait_ms));
    }
  }
}

export { app };
