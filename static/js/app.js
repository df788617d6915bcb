// What the parts of the page share: the live state, what the person has chosen to see, the map, and one
// way to say that something has changed.

import { SpatialIndex } from "./spatial_index.js";
import { one } from "./html.js";
import { colourIndex } from "./map/ink.js";
import { LiveLayers } from "./live/layers.js";
import { makeStage } from "./map/stage.js";
import { people } from "./state/attention.js";
import * as store from "./ui/remembered.js";

/** @typedef {import("./state/live.js").Topic | "tick" | "choice" | "link"} AnyTopic */
/**
 * @typedef {{name: string, latitude_deg: number, longitude_deg: number, height_m: number, gravity_m_s2: number, declination_deg: number, field_ut?: number}} Site
 */
/**
 * Moves of people are shown this often: fifty of them send five times a second each, not at the same
 * moments, and walking pace needs no more.
 */
const MOVES_EVERY_MS = 200;
/** @type {Set<AnyTopic>} */
const MOVES = new Set(["position", "trail"]);

/** @typedef {{name: string, e_m: number, n_m: number, u_m?: number | null}} Place */
/** @typedef {ReturnType<typeof makeApp>} App */

/**
 * @param {Site} site
 * @param {import("./map/plan.js").Plan} plan
 * @param {import("./api.js").Me} me
 * @param {import("./state/live.js").LiveState} live what the feed tells
 */
export function makeApp(site, plan, me, live) {
  /** @type {((changed: Set<AnyTopic>) => void)[]} */
  const watchers = [];
  /** @type {Set<AnyTopic>} */
  let pending = new Set();
  let frame = 0;
  let timer = 0;
  let shownAt = 0;
  /** @type {import("./state/attention.js").Person[] | null} */
  let everybody = null;

  const stage = makeStage(one("#map"), plan.ring_radius_m);
  const app = {
    /** Who is in front of the page. */
    me,
    /** @param {string} right whether they may: what they may not is not offered */
    may: (right) => me.rights.includes(right),
    /**
     * Whether they may write the walks of an inspector: their own, or anybody's where they belong to none.
     * @param {string} inspectorId
     */
    writesFor: (inspectorId) =>
      me.rights.includes("walk") &&
      (me.inspector_id === inspectorId || (me.inspector_id === null && me.rights.includes("walk_for_others"))),
    site,
    plan,
    stage,
    /** @type {Place[]} where the actuators stand: surveyed, where they are */
    places: plan.nodes,
    /** @type {SpatialIndex<Place>} */
    grid: new SpatialIndex(plan.nodes),
    /**
     * Markers are the surveyed anchors; the plan's nodes are right above only near the middle of the dish.
     * @param {Place[]} markers
     */
    setMarkers(markers) {
      const surveyed = new Map(markers.map((m) => [m.name, m]));
      const others = plan.nodes.filter((node) => !surveyed.has(node.name));
      app.places = [...surveyed.values(), ...others];
      app.grid = new SpatialIndex(app.places);
      app.layers.placesMoved();
      app.changed("choice");
    },
    live,
    /** What the person has chosen to see. */
    ui: {
      /** @type {string | null} */
      selected: null,
      /** @type {string | null} */
      fault: null,
      /** @type {string | null} */
      goal: null,
      follow: false,
      ellipses: store.recall("ellipses") !== "no",
      trails: store.recall("trails") !== "no",
      trail_s: Number(store.recall("trail_s") ?? 300),
      search: "",
      /** Only what is in this sector is listed; "" for all. */
      sector: "",
      faults: store.recall("faults") !== "no",
      /** The moment that is looked at; null: now. @type {number | null} */
      at_ms: null,
    },
    /** That moment, once it is known. @type {{state: import("./state/live.js").LiveState, at_ms: number} | null} */
    past: null,
    /** @type {import("./map/runs.js").Runs | null} */
    runs: null,
    /** @type {import("./map/survey.js").Survey | null} */
    survey: null,
    /** Those that the faults' screen lets pass. @type {import("./state/live.js").Fault[] | null} */
    shownFaults: null,
    /** Everybody, those who need attention first; the same list until something has changed. */
    people: () => (everybody ??= people(app.past?.state ?? app.live, app.past?.at_ms ?? Date.now())),
    colour: (/** @type {string} */ inspectorId) => colours.get(inspectorId) ?? giveColour(inspectorId),
    /** @param {AnyTopic[]} topics */
    changed(...topics) {
      everybody = null;
      for (const topic of topics) pending.add(topic);
      if (topics.length === 0 || frame !== 0) return;
      const wait_ms = shownAt + MOVES_EVERY_MS - performance.now();
      if (wait_ms > 0 && topics.every((topic) => MOVES.has(topic))) {
        if (timer === 0) timer = window.setTimeout(ask, wait_ms);
      } else ask();
    },
    onFrame: (/** @type {(changed: Set<AnyTopic>) => void} */ run) => watchers.push(run),
    /** @param {string | null} inspectorId */
    select(inspectorId, follow = true) {
      app.ui.selected = inspectorId;
      app.ui.follow = inspectorId !== null && follow;
      app.changed("choice");
    },
    /** @type {LiveLayers} */
    layers: /** @type {any} */ (null),
  };
  app.layers = new LiveLayers(app);

  /** @type {Map<string, number>} */
  const colours = new Map();
  const COLOURS = 8;
  /** @param {string} id */
  function giveColour(id) {
    // The colour that goes with the id, or the next one that nobody has yet.
    const used = new Set(colours.values());
    let colour = colourIndex(id, COLOURS);
    for (let i = 0; i < COLOURS && used.has(colour) && used.size < COLOURS; i++) colour = (colour + 1) % COLOURS;
    colours.set(id, colour);
    return colour;
  }

  function ask() {
    clearTimeout(timer);
    timer = 0;
    frame = requestAnimationFrame(run);
  }

  function run() {
    frame = 0;
    shownAt = performance.now();
    const changed = pending;
    pending = new Set();
    for (const watcher of watchers) watcher(changed);
  }

  return app;
}
