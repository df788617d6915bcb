// Which screen is shown: the address after the #. A link to a session can be sent to a colleague.

import { one, render, html } from "../html.js";
import { liveView } from "../live/view.js";
import { sessionsView } from "../sessions/list.js";
import { sessionView } from "../sessions/view.js";
import { uploadView } from "../upload/view.js";
import { faultsView } from "../faults/view.js";
import { markersView } from "../markers/view.js";
import { t } from "../i18n.js";

/**
 * @typedef {{update?: (changed: Set<import("../app.js").AnyTopic>) => void, close?: () => void}} View
 * @typedef {(app: import("../app.js").App, side: HTMLElement, argument: string) => View} MakeView
 */

/** Screens, how they share the room with the map, and which place in the navigation they belong to. */
/** @type {Record<string, {make: MakeView, layout: string, place: string}>} */
const SCREENS = {
  live: { make: liveView, layout: "map", place: "live" },
  sessions: { make: sessionsView, layout: "map", place: "sessions" },
  session: { make: sessionView, layout: "wide", place: "sessions" },
  upload: { make: uploadView, layout: "page", place: "upload" },
  faults: { make: faultsView, layout: "map", place: "faults" },
  markers: { make: markersView, layout: "page", place: "markers" },
};

/**
 * @param {string} hash
 * @returns {{screen: string, argument: string}}
 */
export function readRoute(hash) {
  const [path] = hash.replace(/^#\/?/, "").split("?");
  const [first, second] = path.split("/");
  if (first === "sessions" && second) return { screen: "session", argument: decodeURIComponent(second) };
  return { screen: Object.hasOwn(SCREENS, first) ? first : "live", argument: "" };
}

/** @param {import("../app.js").App} app */
export function makeRouter(app) {
  const side = one("#side");
  const main = one("#main");
  /** @type {View | null} */
  let view = null;
  let name = "live";

  function go() {
    view?.close?.();
    const { screen, argument } = readRoute(location.hash);
    const { make, layout, place } = SCREENS[screen];
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
    view = make(app, side, argument);
    app.layers.repaint();
    app.changed("all");
  }

  addEventListener("hashchange", go);
  return { go, again: go, view: () => view, name: () => name };
}
