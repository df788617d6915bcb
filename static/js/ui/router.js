// Which screen is shown: the address after the #. A link to a session can be sent to a colleague.

import { one, render, html } from "../html.js";
import { addWords, t } from "../i18n.js";
import { liveView } from "../live/view.js";
import { openSession } from "../sessions/open.js";
import { readChosen } from "./chosen.js";
import { problemBox } from "./problem.js";
import { mayLeave, unsaved, watchDrafts } from "./unsaved.js";

/**
 * @typedef {{unsaved?: () => boolean, update?: (changed: Set<import("../app.js").AnyTopic>) => void, close?: () => void}} View
 * @typedef {(app: import("../app.js").App, side: HTMLElement, argument: string) => View} MakeView
 */

/**
 * Screens, how they share the room with the map, and which place in the navigation they belong to. The live one comes
 * with the page; the code of another is fetched when it is first opened.
 * @type {Record<string, {load: () => MakeView | Promise<MakeView>, layout: string, place: string}>}
 */
const SCREENS = {
  live: { load: () => liveView, layout: "map", place: "live" },
  sessions: {
    load: () =>
      addWords("sessions")
        .then(() => import("../sessions/list.js"))
        .then((m) => m.sessionsView),
    layout: "map",
    place: "sessions",
  },
  session: { load: () => openSession, layout: "replay", place: "sessions" },
  upload: {
    load: () =>
      addWords("upload")
        .then(() => import("../upload/view.js"))
        .then((m) => m.uploadView),
    layout: "page",
    place: "upload",
  },
  faults: { load: () => import("../faults/view.js").then((m) => m.faultsView), layout: "map", place: "faults" },
  markers: {
    load: () =>
      addWords("markers")
        .then(() => import("../markers/view.js"))
        .then((m) => m.markersView),
    layout: "wide",
    place: "markers",
  },
  me: { load: () => import("../me/view.js").then((m) => m.meView), layout: "page", place: "me" },
  account: {
    load: () =>
      addWords("tokens")
        .then(() => import("../account/view.js"))
        .then((m) => m.accountView),
    layout: "page",
    place: "account",
  },
  lab: {
    load: () =>
      addWords("lab")
        .then(() => import("../lab/view.js"))
        .then((m) => m.labView),
    layout: "page",
    place: "lab",
  },
  api: {
    load: () =>
      addWords("reference")
        .then(() => import("../reference/view.js"))
        .then((m) => m.referenceView),
    layout: "page",
    place: "api",
  },
  admin: {
    load: () =>
      addWords("admin")
        .then(() => import("../admin/view.js"))
        .then((m) => m.adminView),
    layout: "page",
    place: "admin",
  },
};

/**
 * @param {string} hash
 * @returns {{screen: string, argument: string}}
 */
export function readRoute(hash) {
  const [path] = hash.replace(/^#\/?/, "").split("?");
  const [first, second] = path.split("/");
  if (first === "sessions" && second) return { screen: "session", argument: decoded(second) };
  return { screen: Object.hasOwn(SCREENS, first) ? first : "live", argument: second ? decoded(second) : "" };
}

/** An address may have been cut off in the middle of a letter. @param {string} text */
function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** @param {import("../app.js").App} app */
export function makeRouter(app) {
  const side = one("#side");
  const main = one("#main");
  /** @type {View | null} */
  let view = null;
  let name = "live";
  /** Counts the changes of place: a screen whose code comes when another was asked for is not shown. */
  let visits = 0;

  async function go() {
    view?.close?.();
    view = null;
    visits += 1;
    const visit = visits;
    const { screen, argument } = readRoute(location.hash);
    const { load, layout, place } = SCREENS[screen];
    readChosen(app, location.hash);
    name = screen;
    main.dataset.view = screen;
    main.dataset.layout = layout;
    for (const link of document.querySelectorAll("[data-route]")) {
      if (link.getAttribute("data-route") === place) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    document.title = `${t(`nav.${place}`)} · Lodestep`;
    render(side, html``);
    side.replaceChildren();
    side.scrollTop = 0;
    one("#legend").replaceChildren();
    one("#drawer").hidden = true;
    app.stage.map.invalidateSize({ animate: false });
    app.runs = null;
    try {
      const found = load();
      const make = found instanceof Promise ? await found : found;
      if (visit !== visits) return;
      view = make(app, side, argument);
    } catch (error) {
      if (visit === visits) render(side, problemBox(error));
    }
    app.layers.repaint();
    app.changed("all");
  }

  watchDrafts();
  const lost = () => view?.unsaved?.() ?? false;
  /** The address of what is shown. */
  let shown = location.hash;
  addEventListener("hashchange", () => {
    if (!mayLeave(lost())) return history.replaceState(null, "", shown || "#/live");
    shown = location.hash;
    return go();
  });
  addEventListener("beforeunload", (event) => {
    if (unsaved() || lost()) event.preventDefault();
  });
  return { go, again: go, view: () => view, name: () => name };
}
