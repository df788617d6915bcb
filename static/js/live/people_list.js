// The list of people. A row is made once; afterwards only what differs is touched.

import { sectorAt } from "../geometry.js";
import { length, number, shortDuration } from "../format.js";
import { render, setAttribute, setText } from "../html.js";
import { t } from "../i18n.js";
import { presencePath } from "../ui/symbols.js";

const ROW = `
  <svg class="glyph" viewBox="0 0 18 18" aria-hidden="true"></svg>
  <span class="grow"><span class="who"><span class="name"></span><span class="faults-n" hidden></span></span><span class="sub"></span></span>
  <span class="num"><span class="sigma"></span><small class="bars"><i></i><i></i><i></i><i></i></small></span>
  <span class="num"><span class="since-m"></span><small class="since-s"></small></span>`;

/** Bars for a sigma: four below 1.5 m, none where the nearest actuator is a guess. */
const BARS_M = [5, 3.5, 2.5, 1.5];

/** @typedef {{item: HTMLElement, row: HTMLElement, parts: Record<"glyph" | "name" | "faults" | "sub" | "sigma" | "bars" | "sinceM" | "sinceS", Element>}} Row */

export class PeopleList {
  /**
   * @param {import("../app.js").App} app
   * @param {HTMLElement} el
   */
  constructor(app, el) {
    this.app = app;
    this.el = el;
    /** @type {Map<string, Row>} */
    this.rows = new Map();
    el.addEventListener("click", (event) => {
      const id = /** @type {HTMLElement} */ (event.target).closest("[data-inspector]")?.getAttribute("data-inspector");
      if (id) app.select(id === app.ui.selected ? null : id);
    });
  }

  /** Those whose name has what is searched for, and who are in the sector that is. */
  shown() {
    const { ui, plan } = this.app;
    const wanted = ui.search.trim().toLowerCase();
    return this.app.people().filter(({ inspector, position }) => {
      if (!inspector.name.toLowerCase().includes(wanted)) return false;
      if (ui.sector === "") return true;
      return (
        position !== null && sectorAt(plan.sectors, [position.position_m[0], position.position_m[1]]) === ui.sector
      );
    });
  }

  update() {
    const people = this.shown();
    const seen = new Set(people.map((p) => p.inspector.id));
    for (const [id, { item }] of this.rows) {
      if (seen.has(id)) continue;
      item.remove();
      this.rows.delete(id);
    }
    people.forEach((person, i) => {
      const row = this.rows.get(person.inspector.id) ?? this.make(person.inspector.id);
      if (this.el.children[i] !== row.item) this.el.insertBefore(row.item, this.el.children[i] ?? null);
      this.show(row, person);
    });
    setAttribute(this.el, "data-empty", people.length === 0 ? "yes" : null);
  }

  /**
   * @param {string} id
   * @returns {Row}
   */
  make(id) {
    const item = document.createElement("li");
    const row = document.createElement("button");
    row.type = "button";
    row.className = "person-row";
    row.dataset.inspector = id;
    row.dataset.testid = "inspector-row";
    row.innerHTML = ROW;
    item.append(row);
    const find = (/** @type {string} */ selector) => /** @type {Element} */ (row.querySelector(selector));
    const parts = {
      glyph: find(".glyph"),
      name: find(".name"),
      faults: find(".faults-n"),
      sub: find(".sub"),
      sigma: find(".sigma"),
      bars: find(".bars"),
      sinceM: find(".since-m"),
      sinceS: find(".since-s"),
    };
    const made = { item, row, parts };
    this.rows.set(id, made);
    return made;
  }

  /**
   * @param {Row} made
   * @param {import("../state/attention.js").Person} person
   */
  show({ row, parts }, person) {
    const { position } = person;
    const off = person.presence === "off" || person.presence === "gone";
    setAttribute(row, "data-presence", person.presence);
    setAttribute(row, "aria-pressed", String(person.inspector.id === this.app.ui.selected));
    setAttribute(row, "data-east-m", position ? position.position_m[0].toFixed(3) : null);
    setAttribute(row, "data-north-m", position ? position.position_m[1].toFixed(3) : null);
    if (parts.glyph.getAttribute("data-presence") !== person.presence) {
      parts.glyph.setAttribute("data-presence", person.presence);
      render(parts.glyph, presencePath(person.presence));
    }
    setText(parts.name, person.inspector.name);
    setText(parts.sub, subLine(person));
    setText(parts.faults, `◆ ${person.faults}`);
    setAttribute(parts.faults, "hidden", person.faults > 0 ? null : "");
    setAttribute(parts.faults, "aria-label", t("live.faults_n", { n: person.faults }));
    setAttribute(parts.faults, "title", t("live.faults_n", { n: person.faults }));
    setText(parts.sigma, off ? "" : length(person.sigma_m));
    setAttribute(parts.sigma, "class", person.poor ? "sigma flag" : "sigma");
    const bars = person.sigma_m === null ? 0 : BARS_M.filter((limit) => (person.sigma_m ?? 0) < limit).length;
    setAttribute(parts.bars, "data-bars", String(bars));
    setAttribute(parts.bars, "hidden", off || !position ? "" : null);
    setText(parts.sinceM, off || !position ? "" : length(position.since_marker_m));
    setAttribute(parts.sinceM, "class", person.overdue ? "since-m flag" : "since-m");
    setText(parts.sinceS, off || !position ? "" : shortDuration(position.since_marker_s));
  }
}

/** @param {import("../state/attention.js").Person} person */
function subLine(person) {
  const words = [t(`presence.${person.presence}`)];
  if (["gone", "lost", "silent"].includes(person.presence))
    words.push(t("live.ago", { age: shortDuration(person.age_s) }));
  else if (person.presence === "walking" && !person.poor && !person.overdue)
    words.push(`${number(person.session?.position?.speed_m_s, 1)} m/s`);
  if (person.poor) words.push(t("live.poor"));
  else if (person.overdue) words.push(t("live.overdue"));
  return words.join(" · ");
}
