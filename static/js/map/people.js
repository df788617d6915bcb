// People on the map: the disc of their system with an arrow where they face, alone when that is not known, and the
// name. Real elements, so that they can be reached by keyboard and read aloud.

import { t } from "../i18n.js";
import { headingDegrees } from "../geometry.js";
import { length } from "../format.js";
import { setAttribute, setText } from "../html.js";
import { systemOf } from "../systems/index.js";
import { at } from "./stage.js";

/** Beyond this sigma of the heading (half a right angle) an arrow would be a guess. */
const ARROW_SIGMA_RAD = Math.PI / 4;

/** @param {string} disc */
const signOf = (disc) => `
  <svg viewBox="-20 -20 40 40" aria-hidden="true">
    <path class="arrow" d="M0,-20 L9.5,-4.5 A10.5,10.5 0 0 0 -9.5,-4.5 Z"/>
    ${disc}
    <rect class="mark standing" x="-3" y="-3" width="6" height="6"/>
    <path class="mark lost" d="M-3.2,-3.2 L3.2,3.2 M3.2,-3.2 L-3.2,3.2"/>
    <path class="mark silent" d="M-3.6,0 H3.6"/>
  </svg><span class="person-name"></span>`;

/** @typedef {{marker: L.Marker, arrow: Element, name: Element, el: HTMLElement, disc: string}} Sign */

export class PeopleLayer {
  /**
   * @param {L.Map} map
   * @param {(inspectorId: string) => void} onSelect
   */
  constructor(map, onSelect) {
    this.group = L.layerGroup().addTo(map);
    this.map = map;
    this.onSelect = onSelect;
    /** @type {Map<string, Sign>} */
    this.signs = new Map();
  }

  /** @param {boolean} shown */
  setShown(shown) {
    if (shown && !this.map.hasLayer(this.group)) this.group.addTo(this.map);
    else if (!shown) this.group.remove();
    if (shown) (this.signs.clear(), this.group.clearLayers());
  }

  /**
   * @param {import("../state/attention.js").Person[]} people
   * @param {(id: string) => number} colour
   * @param {string | null} selected
   */
  update(people, colour, selected) {
    const seen = new Set();
    for (const person of people) {
      const position = person.session?.position;
      if (!position || person.presence === "off" || person.presence === "gone") continue;
      const id = person.inspector.id;
      seen.add(id);
      const { icon } = systemOf(person.session);
      const made = this.signs.get(id);
      // The carrier of a session of another system has another sign.
      if (made && made.disc !== icon) this.group.removeLayer(made.marker);
      const sign = made?.disc === icon ? made : this.make(id, position.position_m, colour(id), icon);
      sign.marker.setLatLng(at(position.position_m));
      setText(sign.name, person.inspector.name);
      setAttribute(sign.el, "data-presence", person.presence);
      setAttribute(sign.el, "aria-pressed", String(id === selected));
      const words = `${person.inspector.name}, ${t(`presence.${person.presence}`)}, σ ${length(person.sigma_m)}`;
      setAttribute(sign.el, "aria-label", words);
      const known = position.heading_rad !== null && (position.sigma_heading_rad ?? 0) <= ARROW_SIGMA_RAD;
      setAttribute(sign.arrow, "class", known ? "arrow" : "arrow unknown");
      if (known)
        setAttribute(sign.arrow, "transform", `rotate(${headingDegrees(position.heading_rad ?? 0).toFixed(0)})`);
    }
    for (const [id, sign] of this.signs) {
      if (seen.has(id)) continue;
      sign.marker.remove();
      this.group.removeLayer(sign.marker);
      this.signs.delete(id);
    }
  }

  /**
   * @param {string} id
   * @param {ArrayLike<number>} position
   * @param {number} colour
   * @param {string} disc
   * @returns {Sign}
   */
  make(id, position, colour, disc) {
    const icon = L.divIcon({
      className: `person person-${colour + 1}`,
      html: signOf(disc),
      iconSize: [40, 40],
      iconAnchor: [20, 20],
    });
    const marker = L.marker(at(position), { icon, pane: "people", keyboard: true, riseOnHover: true });
    marker.on("click", () => this.onSelect(id));
    marker.on("keypress", (event) => {
      if (event.originalEvent.key === "Enter") this.onSelect(id);
    });
    this.group.addLayer(marker);
    const el = /** @type {HTMLElement} */ (marker.getElement());
    el.dataset.testid = "map-person";
    const arrow = /** @type {Element} */ (el.querySelector(".arrow"));
    const name = /** @type {Element} */ (el.querySelector(".person-name"));
    const sign = { marker, arrow, name, el, disc };
    this.signs.set(id, sign);
    return sign;
  }
}
