// The map itself, in the site's own metres: one map unit is one metre east or north of the origin. No
// projection stands between a position and its dot, so an ellipse of 3 m is 3 m, exactly.

import { EastNorthCanvas } from "./canvas.js";

/**
 * The panes, bottom to top. What changes together shares a canvas and nothing else does: a moving trail redraws no
 * actuator, and each canvas more is a picture of the whole map to be handed over.
 */
const PANES = ["site", "trails", "signs", "people"];

/** @typedef {ReturnType<typeof makeStage>} Stage */

/**
 * @param {HTMLElement} el
 * @param {number} ring_radius_m what to show at first
 */
export function makeStage(el, ring_radius_m) {
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const map = L.map(el, {
    crs: L.CRS.Simple,
    zoomControl: false,
    attributionControl: false,
    minZoom: -1,
    maxZoom: 6,
    zoomSnap: 0.25,
    zoomDelta: 0.75,
    wheelPxPerZoomLevel: 90,
    zoomAnimation: !still,
    fadeAnimation: false,
    inertia: !still,
  });
  PANES.forEach((name, i) => {
    map.createPane(name).style.zIndex = String(410 + 10 * i);
  });
  L.control.scale({ imperial: false, position: "bottomleft", maxWidth: 140 }).addTo(map);

  // Anchors and towers stand outside the ring.
  const margin = ring_radius_m * 1.16;
  const home = L.latLngBounds(at([-margin, -margin]), at([margin, margin]));
  const fit = () => map.fitBounds(home, { animate: false });
  fit();
  map.setMaxBounds(home.pad(1));

  // The banner and the drawer change the room that the map has, not only the window.
  new ResizeObserver(() => map.invalidateSize({ animate: false, pan: false })).observe(el);

  return {
    map,
    fit,
    /**
     * @param {string} pane one of the panes above
     * @param {import("./canvas.js").Draw} draw
     */
    canvas: (pane, draw) => new EastNorthCanvas(map, pane, draw),
    /**
     * @param {import("../geometry.js").EastNorth} place
     * @param {number} [closest] zoom at least this far in, log2 of pixels per metre
     */
    goTo(place, closest) {
      // At once: a zoom that is still under way would put the map back where it was going.
      map.setView(at(place), Math.max(map.getZoom(), closest ?? map.getZoom()), { animate: false });
    },
    /** @returns {() => void} puts the map back to what it shows now */
    remember() {
      const [middle, zoom] = [map.getCenter(), map.getZoom()];
      return () => {
        map.setView(middle, zoom, { animate: false });
      };
    },
    /**
     * Keeps a place near the middle without moving the map for every step.
     * @param {import("../geometry.js").EastNorth} place
     */
    keepInView(place) {
      const point = map.latLngToContainerPoint(at(place));
      const size = map.getSize();
      const off = Math.max(Math.abs(point.x - size.x / 2) / size.x, Math.abs(point.y - size.y / 2) / size.y);
      if (off > 0.18) map.panTo(at(place), { animate: !still, duration: 0.4 });
    },
    /** @param {import("../geometry.js").EastNorth[]} places */
    show(places) {
      if (places.length > 0) map.fitBounds(L.latLngBounds(places.map(at)).pad(0.08), { animate: false, maxZoom: 4 });
    },
  };
}

/**
 * @param {ArrayLike<number>} place east, north
 * @returns {L.LatLng}
 */
export function at(place) {
  return L.latLng(place[1], place[0]);
}

/**
 * @param {L.LatLng} latLng
 * @returns {import("../geometry.js").EastNorth}
 */
export function eastNorth(latLng) {
  return [latLng.lng, latLng.lat];
}
