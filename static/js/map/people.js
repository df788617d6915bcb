// People on the map: the disc of their system with an arrow where they face, alone when that is not known, and the
// name. Real elements, so that they can be reached by keyboard and read aloud. Of those who would hide each other one stands for all, with a
// count; a press fans them out.

import { t } from "../i18n.js";
import { headingDegrees } from "../geometry.js";
import { length } from "../format.js";
import { setAttribute, setText } from "../html.js";
import { crowds, fan } from "./crowds.js";
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
  </svg><span class="person-name"></span><b class="person-count" hidden></b>`;

/** @typedef {{marker: L.Marker, arrow: Element, name: Element, count: Element, el: HTMLElement, disc: string, stands: number}} Sign `stands`: for how many */

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
    /** Who stands for the group that is fanned out. @type {string | null} */
    this.fanned = null;
    map.on("click zoomstart", () => (this.fanned = null));
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
    const shown = people.filter(
      ({ session, presence }) => session?.position && presence !== "off" && presence !== "gone",
    );
    // The selected person stands for a group, then those who need attention.
    const first = shown.filter((person) => person.inspector.id === selected);
    const scale = 2 ** this.map.getZoom();
    const groups = crowds([...first, ...shown.filter((person) => person.inspector.id !== selected)], ({ session }) => {
      const [e, n] = session?.position?.position_m ?? [0, 0];
      return [e * scale, -n * scale];
    });
    for (const person of shown) {
      const position = /** @type {import("../state/live.js").Position} */ (person.session?.position);
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
      setAttribute(sign.el, "data-words", words);
      const known = position.heading_rad !== null && (position.sigma_heading_rad ?? 0) <= ARROW_SIGMA_RAD;
      setAttribute(sign.arrow, "class", known ? "arrow" : "arrow unknown");
      if (known)
        setAttribute(sign.arrow, "transform", `rotate(${headingDegrees(position.heading_rad ?? 0).toFixed(0)})`);
    }
    for (const group of groups) this.arrange(group.map((person) => person.inspector.id));
    for (const [id, sign] of this.signs) {
      if (seen.has(id)) continue;
      sign.marker.remove();
      this.group.removeLayer(sign.marker);
      this.signs.delete(id);
    }
  }

  /**
   * Shows a group as one sign, or fanned out.
   * @param {string[]} ids the first stands for all
   */
  arrange(ids) {
    const fanned = ids.length > 1 && this.fanned !== null && ids.includes(this.fanned);
    const places = fanned ? fan(ids.length) : [];
    ids.forEach((id, i) => {
      const sign = this.signs.get(id);
      if (!sign) return;
      sign.stands = i === 0 && !fanned ? ids.length : 1;
      const { el, count } = sign;
      const hidden = i > 0 && !fanned;
      setAttribute(el, "data-crowd", hidden ? "behind" : fanned ? "fanned" : null);
      setAttribute(el, "tabindex", hidden ? "-1" : "0");
      const [x_px, y_px] = places[i] ?? [0, 0];
      el.style.setProperty("--fan", fanned ? `${x_px}px ${y_px}px` : "none");
      setAttribute(count, "hidden", sign.stands > 1 ? null : "");
      setText(count, sign.stands > 1 ? `+${sign.stands - 1}` : "");
      const words = el.getAttribute("data-words") ?? "";
      setAttribute(el, "aria-label", sign.stands > 1 ? `${words}, ${t("map.crowd", { n: sign.stands - 1 })}` : words);
    });
  }

  /** @param {string} id */
  press(id) {
    const stands = this.signs.get(id)?.stands ?? 1;
    if (stands > 1) this.fanned = id;
    this.onSelect(id);
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
    marker.on("click", () => this.press(id));
    marker.on("keypress", (event) => {
      if (event.originalEvent.key === "Enter") this.press(id);
    });
    this.group.addLayer(marker);
    const el = /** @type {HTMLElement} */ (marker.getElement());
    el.dataset.testid = "map-person";
    const arrow = /** @type {Element} */ (el.querySelector(".arrow"));
    const name = /** @type {Element} */ (el.querySelector(".person-name"));
    const count = /** @type {Element} */ (el.querySelector(".person-count"));
    const sign = { marker, arrow, name, count, el, disc, stands: 1 };
    this.signs.set(id, sign);
    return sign;
  }
}
