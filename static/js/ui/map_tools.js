// The buttons over the map, and the read-out of the pointer's place.

import { number } from "../format.js";
import { one, setAttribute, setText } from "../html.js";
import { eastNorth } from "../map/stage.js";
import { addWords } from "../i18n.js";
import * as store from "./remembered.js";

/** @param {import("../app.js").App} app */
export function makeMapTools(app) {
  const { map } = app.stage;
  one("#zoom-in").addEventListener("click", () => map.zoomIn());
  one("#zoom-out").addEventListener("click", () => map.zoomOut());
  one("#fit").addEventListener("click", () => {
    app.ui.follow = false;
    app.stage.fit();
    app.changed("choice");
  });
  one("#toggle-follow").addEventListener("click", () => {
    // With nobody chosen, follow the one at the top of the list.
    if (!app.ui.selected) app.ui.selected = app.people().find((p) => p.session?.position)?.inspector.id ?? null;
    app.ui.follow = !app.ui.follow && app.ui.selected !== null;
    app.changed("choice");
  });
  one("#toggle-ellipses").addEventListener("click", () => {
    app.ui.ellipses = !app.ui.ellipses;
    store.remember("ellipses", app.ui.ellipses ? "yes" : "no");
    app.changed("choice");
  });
  one("#toggle-trails").addEventListener("click", () => {
    app.ui.trails = !app.ui.trails;
    store.remember("trails", app.ui.trails ? "yes" : "no");
    app.changed("choice");
  });
  one("#toggle-faults").addEventListener("click", () => {
    app.ui.faults = !app.ui.faults;
    store.remember("faults", app.ui.faults ? "yes" : "no");
    app.layers.repaint();
    app.changed("choice");
  });
  one("#toggle-past").addEventListener("click", () => {
    app.ui.at_ms = app.ui.at_ms === null ? Math.floor(Date.now() / 60_000) * 60_000 - 60_000 : null;
    app.changed("choice");
  });
  /** The bar of the past, once somebody has looked there. @type {Promise<{update: () => void}> | null} */
  let pastBar = null;
  one("#trail-chips").addEventListener("click", (event) => {
    const chip = /** @type {HTMLElement} */ (event.target).closest("[data-trail]");
    if (!(chip instanceof HTMLElement)) return;
    app.ui.trail_s = chip.dataset.trail === "all" ? Infinity : Number(chip.dataset.trail);
    app.ui.trails = true;
    store.remember("trail_s", String(app.ui.trail_s));
    app.changed("choice");
  });
  // The hand takes the map: following stops until it is asked for again.
  map.on("dragstart", () => {
    app.ui.follow = false;
    app.changed("choice");
  });

  const readout = one("#readout");
  map.on("mousemove", (event) => {
    const [e, n] = eastNorth(event.latlng);
    const near = app.grid.nearest(e, n, 1, 20)[0];
    setText(readout, `E ${number(e, 1)}  N ${number(n, 1)} m${near ? `  ·  ${near.place.name}` : ""}`);
  });
  map.on("mouseout", () => setText(readout, ""));

  return {
    update() {
      setAttribute(one("#toggle-follow"), "aria-pressed", String(app.ui.follow));
      setAttribute(one("#toggle-ellipses"), "aria-pressed", String(app.ui.ellipses));
      setAttribute(one("#toggle-trails"), "aria-pressed", String(app.ui.trails));
      setAttribute(one("#toggle-faults"), "aria-pressed", String(app.ui.faults));
      setAttribute(one("#toggle-past"), "aria-pressed", String(app.ui.at_ms !== null));
      if (app.ui.at_ms !== null) pastBar ??= loadPastBar(app);
      pastBar?.then((bar) => bar.update(), console.info);
      for (const chip of one("#trail-chips").children) {
        const seconds = chip.getAttribute("data-trail") === "all" ? Infinity : Number(chip.getAttribute("data-trail"));
        setAttribute(chip, "aria-pressed", String(app.ui.trails && seconds === app.ui.trail_s));
      }
    },
  };
}

/** @param {import("../app.js").App} app */
const loadPastBar = (app) =>
  addWords("past")
    .then(() => import("../live/past_bar.js"))
    .then(({ makePastBar }) => makePastBar(app));
