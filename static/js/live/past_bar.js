// The bar below the map by which the control room looks back: a day, a time of day, and how many were on their way then. The map and the
// list show that moment until somebody goes back to the present.

import { faults, moment, searchSessions } from "../api.js";
import { clock, dayBegins, length, siteDay } from "../format.js";
import { html, one, render, setAttribute, setText } from "../html.js";
import { t, translate } from "../i18n.js";
import { inkOf } from "../map/ink.js";
import { hoursBetweenLabels, nearestTo, pastState, underWay } from "../state/past.js";
import { problemBox } from "../ui/problem.js";

const DAY_S = 86_400;
const STEP_S = 60;
/** The strip counts walks by so many minutes. */
const STRETCH_MIN = 10;
/** Below the counts, for the hours. */
const HOURS_PX = 16;
/** So many of those who were nearest are named. */
const NEAREST = 3;

/** @param {import("../app.js").App} app */
export function makePastBar(app) {
  const el = document.createElement("section");
  el.id = "past-bar";
  el.dataset.testid = "past-bar";
  one("#stage").append(el);
  render(
    el,
    html`<div class="past-row">
        <button type="button" data-live data-t="past.live"></button>
        <input type="date" data-t-label="past.day" />
        <button type="button" class="icon" data-step="-1" data-t-label="past.earlier">‹</button>
        <output class="past-clock"></output>
        <button type="button" class="icon" data-step="1" data-t-label="past.later">›</button>
        <span class="muted past-said grow" role="status"></span>
      </div>
      <canvas class="past-strip" aria-hidden="true"></canvas>
      <input type="range" min="0" max="${DAY_S - 1}" step="10" data-t-label="past.time" />
      <div class="past-problem"></div>`,
  );
  translate(el);
  const day = /** @type {HTMLInputElement} */ (one("[type=date]", el));
  const range = /** @type {HTMLInputElement} */ (one("[type=range]", el));
  const strip = /** @type {HTMLCanvasElement} */ (one("canvas", el));

  /** @param {number} at_ms */
  function go(at_ms) {
    app.ui.at_ms = at_ms;
    app.changed("choice");
  }
  const begins = () => dayBegins(siteDay(app.ui.at_ms ?? Date.now()));
  range.addEventListener("input", () => go(begins() + Number(range.value) * 1000));
  day.addEventListener("change", () => {
    // A field that was emptied says nothing.
    if (day.value) go(dayBegins(day.value) + Number(range.value) * 1000);
  });
  el.addEventListener("click", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const step = target.closest("[data-step]")?.getAttribute("data-step");
    if (step && app.ui.at_ms !== null) go(app.ui.at_ms + Number(step) * STEP_S * 1000);
    if (target.closest("[data-live]")) {
      app.ui.at_ms = null;
      app.changed("choice");
    }
  });

  /** @type {number | null} what is shown, or asked for */
  let asked = null;
  let onItsWay = false;
  /** @type {Promise<import("../state/live.js").Fault[]> | null} asked for once a visit to the past */
  let reported = null;

  async function fetchMoment() {
    if (onItsWay || app.ui.at_ms === null || app.ui.at_ms === asked) return;
    onItsWay = true;
    const at_ms = (asked = app.ui.at_ms);
    const problem = one(".past-problem", el);
    try {
      reported ??= faults();
      const [then, all] = await Promise.all([moment(new Date(at_ms).toISOString()), reported]);
      if (app.ui.at_ms !== null) app.past = { state: pastState(then, app.live, all), at_ms };
      render(problem, html``);
    } catch (error) {
      reported = null;
      render(problem, problemBox(error));
    }
    onItsWay = false;
    app.changed("all");
  }

  let shownDay = "";
  /** @type {number[]} */
  let counts = [];
  async function fetchDay() {
    const wanted = siteDay(app.ui.at_ms ?? Date.now());
    if (wanted === shownDay) return;
    shownDay = wanted;
    const begins_ms = dayBegins(wanted);
    // Walks that began on the eve may go on past midnight.
    const from = new Date(begins_ms - DAY_S * 1000).toISOString();
    const to = new Date(begins_ms + DAY_S * 1000).toISOString();
    const query = new URLSearchParams({ from, to, limit: "500" });
    const page = await searchSessions(query).catch(() => ({ sessions: [] }));
    if (wanted !== shownDay) return;
    counts = underWay(page.sessions, begins_ms, DAY_S / 60 / STRETCH_MIN, STRETCH_MIN * 60_000);
    drawStrip();
  }

  function drawStrip() {
    const g = strip.getContext("2d");
    if (!g) return;
    const [width, height] = [strip.clientWidth, strip.clientHeight];
    const ratio = window.devicePixelRatio || 1;
    strip.width = Math.round(width * ratio);
    strip.height = Math.round(height * ratio);
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { accent, muted, font } = inkOf();
    const ground = height - HOURS_PX;
    const most = Math.max(1, ...counts);
    g.fillStyle = accent;
    counts.forEach((count, i) => {
      const tall = (count / most) * ground;
      g.fillRect((i * width) / counts.length, ground - tall, width / counts.length, tall);
    });
    g.fillStyle = muted;
    g.font = `10px ${font}`;
    g.textAlign = "center";
    const every = hoursBetweenLabels(width);
    for (let hour = 0; hour <= 24; hour += 1) {
      const x = (hour * width) / 24;
      const named = hour % every === 0;
      g.fillRect(Math.min(x, width - 1), ground, 1, named ? 4 : 2);
      if (named && hour > 0 && hour < 24) g.fillText(`${hour}:00`, x, height - 1);
    }
  }
  new ResizeObserver(drawStrip).observe(strip);

  function said() {
    if (!app.past) return "";
    if ((app.ui.at_ms ?? 0) > Date.now() + app.live.server_offset_ms) return t("past.ahead");
    const n = app.people().filter((p) => p.session).length;
    const goal = app.ui.goal ? app.grid.named(app.ui.goal) : undefined;
    if (n === 0) return t("past.none");
    if (!goal) return t("past.walks", { n });
    const near = nearestTo(app.past.state, [goal.e_m, goal.n_m], NEAREST);
    const names = near.map(({ name, distance_m }) => `${name} ${length(distance_m)}`).join(" · ");
    return `${t("past.near", { place: goal.name })}: ${names}`;
  }

  return {
    update() {
      const { at_ms } = app.ui;
      const open = at_ms !== null;
      el.hidden = !open;
      setAttribute(one("#main"), "data-past", open ? "yes" : null);
      if (!open) {
        asked = null;
        reported = null;
        if (app.past) {
          app.past = null;
          app.changed("all");
        }
        return;
      }
      if (day.value !== siteDay(at_ms)) day.value = siteDay(at_ms);
      range.value = String(Math.floor((at_ms - dayBegins(siteDay(at_ms))) / 1000));
      setText(one(".past-clock", el), clock(at_ms));
      setText(one(".past-said", el), said());
      fetchDay();
      fetchMoment();
    },
  };
}
