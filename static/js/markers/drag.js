// A marker that can be dragged, in edit mode alone: elsewhere a hand that slips moves nothing. The arrow keys do the
// same by tenths of a metre, with Shift by metres; every move can be taken back.

import { at, eastNorth } from "../map/stage.js";
import { t } from "../i18n.js";

/** @type {Record<string, [number, number]>} */
const STEPS = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };

/**
 * @param {import("../app.js").App} app
 * @param {(place: import("../geometry.js").EastNorth) => void} onMove
 */
export function makeDrag(app, onMove) {
  /** @type {L.Marker | null} */
  let handle = null;
  /** @type {import("../geometry.js").EastNorth[]} */
  let before = [];

  /** @param {import("../geometry.js").EastNorth} place */
  function move(place) {
    // A map is no survey: the hand's place is good to a centimetre at best.
    const rounded = /** @type {import("../geometry.js").EastNorth} */ (
      place.map((metres) => Math.round(metres * 100) / 100)
    );
    handle?.setLatLng(at(rounded));
    onMove(rounded);
  }

  return {
    active: () => handle !== null,
    canUndo: () => before.length > 0,
    /** @param {import("../geometry.js").EastNorth} place */
    start(place) {
      before = [];
      const icon = L.divIcon({ className: "drag-handle", iconSize: [34, 34], iconAnchor: [17, 17] });
      handle = L.marker(at(place), {
        icon,
        draggable: true,
        keyboard: true,
        pane: "people",
        title: t("markers.drag_handle"),
        alt: t("markers.drag_handle"),
      });
      handle.on("dragstart", () => {
        if (handle) before.push(eastNorth(handle.getLatLng()));
      });
      handle.on("dragend", () => {
        if (handle) move(eastNorth(handle.getLatLng()));
      });
      handle.addTo(app.stage.map);
      const el = handle.getElement();
      if (!el) return;
      el.dataset.testid = "drag-handle";
      el.addEventListener("keydown", (event) => {
        const step = STEPS[event.key];
        if (!step || !handle) return;
        event.preventDefault();
        event.stopPropagation();
        const metres = event.shiftKey ? 1 : 0.1;
        const here = eastNorth(handle.getLatLng());
        before.push(here);
        move([here[0] + step[0] * metres, here[1] + step[1] * metres]);
      });
      el.focus();
    },
    undo() {
      const place = before.pop();
      if (!place) return;
      handle?.setLatLng(at(place));
      onMove(place);
    },
    stop() {
      handle?.remove();
      handle = null;
      before = [];
    },
  };
}
