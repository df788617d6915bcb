// The charts under the map: which are shown, the stretch of time that they show, and the cursor across them.

import { number } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { valueAt, wrapDegrees } from "./lines.js";
import { inkNamed } from "../map/ink.js";
import { LEFT, drawPlot } from "./plot.js";
import * as kit from "./plots.js";
import { watchPointer } from "./pointer.js";
import { FIRST, word } from "../systems/index.js";
import { recall, remember } from "../ui/remembered.js";

/** More than the view is fetched, so that a small move shows no bare edge. */
const MARGIN = 0.5;
/** How long the view has to rest before it is fetched anew, ms. */
const REST_MS = 180;
/** Charts so close to the edge of what is in sight are drawn, too, px. */
const SIGHT_PX = 60;
/** Nobody looks at less than this, s. */
const LEAST_SPAN_S = 0.5;

/**
 * @typedef {{
 *   fetch: (stretch: import("./clock.js").Stretch | null, buckets: number, charts: string[]) => Promise<import("./lines.js").Charts>,
 *   seek: (t_s: number) => void, select: (a_s: number, b_s: number) => void, viewChanged: () => void, loaded: () => void, failed: (error: unknown) => void,
 *   dots: (plot: import("./plots.js").Plot) => import("./plot.js").Dot[],
 * }} Ways what the charts need of the rest of the screen
 */

/**
 * @param {HTMLElement} el
 * @param {import("../systems/index.js").System} system
 * @param {Ways} ways
 */
export function makeCharts(el, system, ways) {
  render(
    el,
    html`<div class="plot-groups" role="group" data-t-label="plots.label">
        <span class="of-system"></span>
        <span class="spacer"></span>
        <button type="button" data-zoom="in" data-t-label="plots.zoom_in">+</button
        ><button type="button" data-zoom="out" data-t-label="plots.zoom_out">−</button>
        <button type="button" data-zoom="loop" data-t="plots.zoom_loop"></button
        ><button type="button" data-zoom="all" data-t="plots.zoom_all"></button>
      </div>
      <div class="plots" tabindex="0" role="region" data-t-label="plots.label">
        <div class="plots-inner">
          <div class="plot-list"></div>
          <div class="plots-cursor" hidden></div>
        </div>
      </div>`,
  );
  const list = one(".plot-list", el);
  const cursor = one(".plots-cursor", el);
  const room = one(".plots", el);
  /** Plots that show what they should. @type {Set<string>} */
  const drawn = new Set();
  let plots = system.plots(kit);
  let groups = chosenGroups(system);
  /** @type {Map<string, import("./lines.js").Line>} */
  let lines = new Map();
  /** @type {import("./lines.js").Limit[]} */
  let limits = [];
  let [from_s, to_s, first_s, last_s, t_s] = [0, 1, 0, 1, 0];
  let resting = 0;
  let asked = 0;
  let frame = 0;

  const line = (/** @type {string} */ chart, /** @type {string} */ series) => lines.get(`${chart} ${series}`);
  const shown = () => plots.filter((plot) => groups.has(plot.group));

  function layOut() {
    render(
      one(".of-system", el),
      html`${system.plotGroups.map((group) => html`<button type="button" data-group="${group}" aria-pressed="false">${word(system, `plots.${group}`)}</button>`)}`,
    );
    for (const button of el.querySelectorAll("[data-group]"))
      button.setAttribute("aria-pressed", String(groups.has(button.getAttribute("data-group") ?? "")));
    render(
      list,
      html`${shown().map(
        (plot) =>
          html`<div class="plot" data-plot="${plot.id}">
            <p class="plot-head">
              <b>${word(system, plot.title)}${plot.unit && ` · ${plot.unit}`}</b>${plot.lines.map(
                (l, i) =>
                  html`<span class="key" data-line="${String(i)}" hidden
                    ><svg viewBox="0 0 14 8" aria-hidden="true"><line x1="0" y1="4" x2="14" y2="4" /></svg
                    >${word(system, l.label)} <b class="mono"></b
                  ></span>`,
              )}
            </p>
            <canvas aria-hidden="true"></canvas>
          </div>`,
      )}`,
    );
    draw();
  }

  /** Draws all charts anew with the next frame. */
  function draw() {
    if (frame === 0) frame = requestAnimationFrame(drawNow);
  }

  function drawNow() {
    frame = 0;
    for (const plot of shown()) {
      const box = list.querySelector(`[data-plot="${plot.id}"]`);
      if (!box) continue;
      const empty = ways.dots(plot).length === 0 && !plot.lines.some((l) => line(l.chart, l.series));
      box.toggleAttribute("hidden", empty);
      if (empty) continue;
      plot.lines.forEach((l, i) => {
        const key = one(`[data-line="${i}"]`, box);
        key.hidden = !line(l.chart, l.series);
        const stroke = part(key, "line");
        stroke.setAttribute("stroke", inkNamed(l.ink));
        stroke.setAttribute("stroke-dasharray", (l.dots ? [2, 2] : (l.dash ?? [])).join(" "));
      });
    }
    drawn.clear();
    drawInSight();
    placeCursor();
  }

  /** Those that are scrolled into sight and not drawn yet: a line of a thousand peaks takes its time. */
  function drawInSight() {
    const { scrollTop, clientHeight } = room;
    for (const plot of shown()) {
      const box = /** @type {HTMLElement | null} */ (list.querySelector(`[data-plot="${plot.id}"]`));
      const canvas = box?.querySelector("canvas");
      if (!box || !canvas || box.hidden || drawn.has(plot.id)) continue;
      if (
        box.offsetTop > scrollTop + clientHeight + SIGHT_PX ||
        box.offsetTop + box.offsetHeight < scrollTop - SIGHT_PX
      )
        continue;
      drawn.add(plot.id);
      const charts = new Set(plot.lines.map((l) => l.chart));
      drawPlot(canvas, {
        plot,
        line,
        limits: limits.filter((limit) => charts.has(limit.chart)),
        dots: ways.dots(plot),
        from_s,
        to_s,
      });
    }
  }

  function placeCursor() {
    const width = list.clientWidth;
    const share = (t_s - from_s) / (to_s - from_s);
    cursor.hidden = lines.size === 0 || share < 0 || share > 1;
    cursor.style.transform = `translateX(${LEFT + share * (width - LEFT)}px)`;
    for (const plot of shown()) {
      if (!drawn.has(plot.id)) continue;
      plot.lines.forEach((l, i) => {
        const words = list.querySelector(`[data-plot="${plot.id}"] [data-line="${i}"] b`);
        if (!words) return;
        const value = valueAt(line(l.chart, l.series), t_s);
        const figure = value === null ? null : plot.angle ? wrapDegrees(value * plot.factor) : value * plot.factor;
        setText(words, number(figure, plot.digits));
      });
    }
  }

  /** @param {boolean} [whole] of a walk whose length is not known yet */
  async function load(whole = false) {
    clearTimeout(resting);
    const mine = ++asked;
    const room_s = (to_s - from_s) * MARGIN;
    const [a_s, b_s] = [Math.max(first_s, from_s - room_s), Math.min(last_s, to_s + room_s)];
    const width = Math.max(200, (whole ? innerWidth * 0.7 : list.clientWidth) - LEFT);
    const buckets = Math.min(4000, Math.ceil(whole ? width : (width * (b_s - a_s)) / (to_s - from_s)));
    try {
      const answer = await ways.fetch(whole ? null : [a_s, b_s], buckets, kit.chartsOf(shown(), system.readouts));
      // Somebody has moved on meanwhile: a later answer is on its way.
      if (mine !== asked) return;
      lines = new Map(answer.series.map((found) => [`${found.chart} ${found.series}`, found]));
      limits = answer.limits;
      draw();
      ways.loaded();
    } catch (error) {
      if (mine === asked) ways.failed(error);
    }
  }

  /**
   * @param {number} a_s
   * @param {number} b_s
   */
  function setView(a_s, b_s) {
    const span_s = Math.min(last_s - first_s, Math.max(LEAST_SPAN_S, b_s - a_s));
    from_s = Math.min(Math.max(first_s, a_s), last_s - span_s);
    to_s = from_s + span_s;
    draw();
    ways.viewChanged();
    clearTimeout(resting);
    resting = window.setTimeout(() => load(), REST_MS);
  }

  /**
   * @param {number} by the new span is the old one times this
   * @param {number} about_s stays where it is
   */
  const zoom = (by, about_s) => setView(about_s - (about_s - from_s) * by, about_s + (to_s - about_s) * by);
  const timeAt = (/** @type {number} */ px) =>
    from_s + ((px - LEFT) / Math.max(1, list.clientWidth - LEFT)) * (to_s - from_s);

  watchPointer(list, { timeAt, seek: ways.seek, select: ways.select });
  el.addEventListener(
    "wheel",
    (event) => {
      // The plain wheel scrolls the list of charts.
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      zoom(event.deltaY > 0 ? 1.4 : 1 / 1.4, timeAt(event.clientX - list.getBoundingClientRect().left));
    },
    { passive: false },
  );
  /** @type {(() => import("./clock.js").Stretch | null)} */
  let loop = () => null;
  el.addEventListener("click", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const group = target.closest("[data-group]")?.getAttribute("data-group");
    if (group) {
      if (!groups.delete(group)) groups.add(group);
      remember(`plots.${system.name}`, [...groups].join(","));
      layOut();
      load();
    }
    const asks = target.closest("[data-zoom]")?.getAttribute("data-zoom");
    const about_s = t_s > from_s && t_s < to_s ? t_s : (from_s + to_s) / 2;
    if (asks === "in") zoom(0.5, about_s);
    if (asks === "out") zoom(2, about_s);
    if (asks === "all") setView(first_s, last_s);
    const stretch = loop();
    if (asks === "loop" && stretch) setView(...stretch);
  });
  room.addEventListener("scroll", () => {
    drawInSight();
    placeCursor();
  });
  const sized = new ResizeObserver(draw);
  sized.observe(list);
  layOut();

  return {
    line,
    draw,
    load,
    setView,
    /** The walk has proved to be of another system. @param {import("../systems/index.js").System} other */
    setSystem(other) {
      system = other;
      plots = system.plots(kit);
      groups = chosenGroups(system);
      layOut();
    },
    view: () => /** @type {import("./clock.js").Stretch} */ ([from_s, to_s]),
    /** @param {() => import("./clock.js").Stretch | null} asked */
    setLoop(asked) {
      loop = asked;
    },
    /**
     * The whole of what there is to see.
     * @param {number} a_s
     * @param {number} b_s
     */
    setSpan(a_s, b_s) {
      const all = from_s === first_s && to_s === last_s;
      [first_s, last_s] = [a_s, b_s];
      if (all) [from_s, to_s] = [a_s, b_s];
      // The lines may have come before the track.
      if (lines.size > 0) draw();
    },
    /** @param {number} at_s */
    moveCursor(at_s) {
      t_s = at_s;
      const span_s = to_s - from_s;
      // Zoomed in, the view goes along, a page at a time.
      if (lines.size > 0 && (t_s < from_s || t_s > to_s)) setView(t_s - span_s * 0.1, t_s + span_s * 0.9);
      else placeCursor();
    },
    close() {
      sized.disconnect();
      cancelAnimationFrame(frame);
      clearTimeout(resting);
      asked = -1;
    },
  };
}

/** The groups that were chosen last, else those shown at first. @param {import("../systems/index.js").System} system */
function chosenGroups({ name, plotGroups, firstPlotGroups }) {
  // What was chosen before there were several systems was this one's.
  const kept = recall(`plots.${name}`) ?? (name === FIRST ? recall("plots") : null);
  const chosen = kept?.split(",") ?? firstPlotGroups;
  return new Set(chosen.filter((group) => plotGroups.includes(group)));
}

/**
 * @param {Element} el
 * @param {string} selector
 */
function part(el, selector) {
  const found = el.querySelector(selector);
  if (!found) throw new Error(`no element ${selector}`);
  return found;
}
