// What the map shows, layer by layer. A layer is redrawn only when something of its own has changed.

import { drawActuators } from "../map/actuators.js";
import { drawEllipses } from "../map/ellipses.js";
import { drawFaults, faultAt } from "../map/faults.js";
import { PeopleLayer } from "../map/people.js";
import { drawPlan } from "../map/plan.js";
import { drawRuns } from "../map/runs.js";
import { stands } from "../faults/states.js";
import { Trails } from "../map/trails.js";
import { eastNorth } from "../map/stage.js";

/** How many actuators near the selected person stand out. */
const NEAR = 5;

export class LiveLayers {
  /** @param {import("../app.js").App} app */
  constructor(app) {
    this.app = app;
    const { stage, plan } = app;
    const ground = drawPlan(plan);
    const actuators = drawActuators(
      () => app.places,
      () => ({ named: this.near, goal: app.ui.goal }),
    );
    this.site = stage.canvas("site", (g, paper) => {
      ground(g, paper);
      actuators(g, paper);
    });
    this.site.setShown(true);
    this.walks = new Trails(() => ({ walked: this.walked(), seconds: app.ui.trail_s }));
    this.past = stage.canvas("trails", this.walks.drawPast);
    this.trails = stage.canvas("trails", this.walks.drawRecent);
    this.runs = stage.canvas(
      "trails",
      drawRuns(() => app.runs),
    );
    /** The markers' own, made by their screen. @type {import("../map/canvas.js").EastNorthCanvas | null} */
    this.survey = null;
    const faults = drawFaults(() => ({ faults: this.faultsShown(), selected: app.ui.fault }));
    const ellipses = drawEllipses(() => (app.ui.ellipses ? this.ellipsesShown() : []));
    this.signs = stage.canvas("signs", (g, paper) => {
      faults(g, paper);
      ellipses(g, paper);
    });
    this.people = new PeopleLayer(stage.map, (id) => app.select(id));
    /** @type {Set<string>} */
    this.near = new Set();
    this.screen = "";
    /** Whether the past is drawn yet: it is the longest to draw and the least looked for, so the people stand there before it. */
    this.pastDue = /** @type {"no" | "soon" | "yes"} */ ("no");
    // Who stands for whom depends on how near they are on the screen.
    stage.map.on("zoomend", () => app.changed("position"));
    stage.map.on("click", (event) => this.click(eastNorth(event.latlng)));
  }

  /** @param {import("../geometry.js").EastNorth} place */
  click(place) {
    const { app } = this;
    if (this.screen !== "live" && this.screen !== "faults") return;
    const reach_m = 12 / 2 ** app.stage.map.getZoom();
    const fault = faultAt(this.faultsShown(), place, reach_m);
    app.ui.fault = fault?.id ?? null;
    app.changed("choice");
  }

  openFaults() {
    return [...(this.app.past?.state ?? this.app.live).faults.values()].filter(stands);
  }

  /** On the faults' own screen those that its filters let pass, else all that stand, unless they are switched off. */
  faultsShown() {
    if (this.screen === "faults" && this.app.shownFaults) return this.app.shownFaults;
    return this.app.ui.faults ? this.openFaults() : [];
  }

  /** @returns {import("../map/trails.js").Walked[]} */
  walked() {
    const { app } = this;
    return this.present()
      .flatMap(({ inspector, session }) =>
        session ? [{ session, colour: app.colour(inspector.id), selected: inspector.id === app.ui.selected }] : [],
      )
      .sort((a, b) => Number(a.selected) - Number(b.selected));
  }

  ellipsesShown() {
    const { app } = this;
    return this.present().flatMap(({ inspector, position, presence }) =>
      position
        ? [
            {
              position,
              colour: app.colour(inspector.id),
              selected: inspector.id === app.ui.selected,
              stale: presence === "lost" || presence === "silent",
            },
          ]
        : [],
    );
  }

  present() {
    return this.app.people().filter((p) => p.session !== null && p.presence !== "off" && p.presence !== "gone");
  }

  /** After a change of theme or of words: everything. */
  repaint() {
    for (const canvas of [this.site, this.past, this.trails, this.runs, this.survey, this.signs]) canvas?.invalidate();
  }

  /** Markers have come, or stand elsewhere now. */
  placesMoved() {
    this.site.invalidate();
    this.survey?.invalidate();
  }

  /**
   * @param {Set<import("../app.js").AnyTopic>} changed
   * @param {string} screen
   */
  update(changed, screen) {
    const { app } = this;
    const has = (/** @type {import("../app.js").AnyTopic[]} */ ...topics) => topics.some((topic) => changed.has(topic));
    const live = screen === "live" || screen === "faults";
    if (screen !== this.screen) {
      this.screen = screen;
      this.people.setShown(live);
      this.runs.setShown(screen === "session");
      this.survey?.setShown(screen === "markers");
    }
    // Before the first snapshot there is nothing to draw.
    const known = live && app.live.boot !== null;
    if (known && this.pastDue === "no") this.drawPastSoon();
    this.past.setShown(known && app.ui.trails && this.pastDue === "yes");
    this.trails.setShown(known && app.ui.trails);
    this.signs.setShown(known);
    if (screen === "session") this.runs.invalidate();
    if (!live) {
      if (this.near.size > 0) {
        this.near = new Set();
        this.site.invalidate();
      }
      return;
    }
    if (has("all", "position", "trail", "choice", "session")) {
      this.trails.invalidate();
      if (has("all", "choice", "session") || this.walks.pastIsStale()) this.past.invalidate();
    }
    if (has("all", "position", "choice", "session", "tick")) {
      this.signs.invalidate();
      this.people.update(app.people(), app.colour, app.ui.selected);
      this.markNear();
    }
    if (has("fault")) this.signs.invalidate();
    if (app.ui.follow && app.ui.selected && has("all", "position", "choice")) {
      const position = app.people().find((p) => p.inspector.id === app.ui.selected)?.session?.position;
      if (position) app.stage.keepInView([position.position_m[0], position.position_m[1]]);
    }
  }

  /** Once what this frame shows has been painted. */
  drawPastSoon() {
    this.pastDue = "soon";
    const due = () => {
      this.pastDue = "yes";
      this.app.changed("choice");
    };
    requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(due)));
  }

  /** Rings around the actuators near the selected person; the canvas is redrawn only when they are others. */
  markNear() {
    const { app } = this;
    const position = app.people().find((p) => p.inspector.id === app.ui.selected)?.session?.position;
    const near = position
      ? app.grid.nearest(position.position_m[0], position.position_m[1], NEAR).map((n) => n.place.name)
      : [];
    if (near.length === this.near.size && near.every((name) => this.near.has(name))) return;
    this.near = new Set(near);
    this.site.invalidate();
  }
}
