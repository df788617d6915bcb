// Everything about the selected person. What can be pressed stays the same element while figures change:
// a button that is replaced five times a second cannot be clicked.

import { endSession } from "../api.js";
import { clock, dateTime, duration, elapsed, heading, length, number, percent, shortDuration } from "../format.js";
import { rankPlaces } from "../geometry.js";
import { html, one, render, setAttribute, setText } from "../html.js";
import { t, translate } from "../i18n.js";
import { offBefore, visitOutcome, visitTime } from "../state/findings.js";
import { standCards, standClicked } from "../stands/list.js";
import { aboutAnomaly, streamOf, systemOf, word } from "../systems/index.js";
import { sentence } from "../sentences.js";
import { problemBox } from "../ui/problem.js";
import { presenceGlyph } from "../ui/symbols.js";

const CANDIDATES = 5;
/** Stands shown, the newest. */
const STANDS = 2;
/** Actuators beyond this many metres are not worth a line. */
const CANDIDATES_WITHIN_M = 60;

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} el
 */
export function makeDrawer(app, el) {
  /** @type {string | null} */
  let shown = null;
  /** Once it was asked for. @type {Promise<ReturnType<typeof import("../faults/form.js").makeFaultForm>> | null} */
  let faultForm = null;

  const onClick = (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const person = current();
    const place = target.closest("[data-place]")?.getAttribute("data-place");
    const ends = target.closest("[data-end]") && person?.session;
    const asked = ends ? endSession(ends.id) : person?.session ? standClicked(target, person.session.id) : null;
    if (asked) {
      const problem = one(".stand-problem", el);
      asked.then(
        () => render(problem, html``),
        (error) => render(problem, problemBox(error)),
      );
    } else if (place) {
      const node = app.grid.named(place);
      if (node) {
        app.ui.goal = node.name;
        app.stage.goTo([node.e_m, node.n_m], 3);
        app.layers.repaint();
      }
    } else if (target.closest("[data-close-drawer]")) app.select(null);
    else if (target.closest("[data-report]") && person) {
      faultForm ??= loadFaultForm().then(({ makeFaultForm }) => makeFaultForm(app));
      faultForm.then((form) => form.show(person, candidates(person)), console.info);
    } else if (target.closest("[data-follow]")) {
      app.ui.follow = !app.ui.follow;
      app.changed("choice");
    }
  };
  el.addEventListener("click", onClick);

  const current = () => app.people().find((p) => p.inspector.id === app.ui.selected);

  /** @param {import("../state/attention.js").Person} person */
  function candidates(person) {
    const { position } = person;
    if (!position) return [];
    const [e, n] = position.position_m;
    const near = app.grid.within(e, n, CANDIDATES_WITHIN_M).map((found) => found.place);
    return rankPlaces([e, n], position.sigma_m, position.covariance_en_m2, near).slice(0, CANDIDATES);
  }

  /** @param {import("../state/attention.js").Person} person */
  function build(person) {
    render(
      el,
      html` <header data-id="${person.inspector.id}">
          <span class="state"></span>
          <h2></h2>
          <button type="button" class="quiet icon" data-close-drawer data-t-label="close">✕</button>
        </header>
        <section class="actions">
          <button type="button" data-follow data-t="map.follow"></button
          ><button type="button" data-report data-testid="report-fault" data-t="fault.report"></button
          ><button type="button" data-end data-testid="end-walk" data-t="drawer.end"></button>
        </section>
        <section>
          <h3 data-t="drawer.position"></h3>
          <div class="enu"></div>
          <dl class="facts"></dl>
        </section>
        <section class="near">
          <h3 data-t="drawer.near"></h3>
          ${Array.from({ length: CANDIDATES }, () => html`<div class="candidate"><button type="button" data-place=""></button><progress max="1" value="0" aria-hidden="true"></progress><span class="num p"></span><span class="num d"></span></div>`)}
          <p class="muted near-rest"></p>
        </section>
        <section>
          <h3 data-t="stand.title"></h3>
          <div class="stands"></div>
          <div class="stand-problem"></div>
        </section>
        <section>
          <h3 data-t="drawer.visits"></h3>
          <div class="visits"></div>
        </section>
        <section>
          <h3 data-t="drawer.anomalies"></h3>
          <div class="anomalies"></div>
        </section>`,
    );
    translate(el);
  }

  /** @param {import("../state/attention.js").Person} person */
  function fill(person) {
    const { position } = person;
    setText(one("h2", el), person.inspector.name);
    render(one(".state", el), presenceGlyph(person.presence));
    setAttribute(one("[data-follow]", el), "aria-pressed", String(app.ui.follow));
    // What is past is looked at.
    const writes = !app.past && app.writesFor(person.inspector.id);
    one("[data-report]", el).hidden = !writes;
    one("[data-end]", el).hidden = !writes || !["silent", "lost", "gone"].includes(person.presence);
    setAttribute(one("[data-report]", el), "disabled", position ? null : "");
    render(
      one(".enu", el),
      html`${["east", "north", "up"].map(
        (axis, i) =>
          html` <div>
            <small>${t(`axis.${axis}`)}</small><b>${number(position?.position_m[i], 1)}</b
            ><small>± ${number(position?.sigma_m[i], 1)} m</small>
          </div>`,
      )}`,
    );
    const session = person.session;
    render(
      one(".facts", el),
      html` <dt>${t("drawer.state")}</dt>
        <dd>
          ${t(`presence.${person.presence}`)}${(person.age_s ?? 0) >= 3 && html` · ${t("live.ago", { age: shortDuration(person.age_s) })}`}
        </dd>
        <dt>${t("drawer.sigma")}</dt>
        <dd class="${person.poor ? "warn" : ""}">${length(person.sigma_m)}</dd>
        <dt>${t("drawer.heading")}</dt>
        <dd>${heading(position?.heading_rad)} · ${number(position?.speed_m_s, 1)} m/s</dd>
        <dt>${t("drawer.since_marker")}</dt>
        <dd class="${person.overdue ? "warn" : ""}">
          ${length(position?.since_marker_m)} · ${duration(position?.since_marker_s)}
        </dd>
        <dt>${t("drawer.walked")}</dt>
        <dd>${length(position?.distance_m)}${position && html` · ${duration(position.t_ns / 1e9)}`}</dd>
        <dt>${t("drawer.started")}</dt>
        <dd>${session?.started_at ? dateTime(session.started_at) : "–"}</dd>`,
    );

    const near = candidates(person);
    [...el.querySelectorAll(".near .candidate")].forEach((line, i) => {
      const candidate = near[i];
      /** @type {HTMLElement} */ (line).hidden = !candidate;
      if (!candidate) return;
      const button = one("button", line);
      setText(button, candidate.place.name);
      setAttribute(button, "data-place", candidate.place.name);
      setAttribute(one("progress", line), "value", candidate.probability.toFixed(2));
      setText(one(".p", line), percent(candidate.probability));
      setText(one(".d", line), length(candidate.distance_m));
    });
    setText(one(".near-rest", el), nearRest(near));

    // The newest first; a button stays the same element as long as nothing of the stands changes.
    const stands = (session?.stands ?? []).slice(-STANDS).reverse();
    render(
      one(".stands", el),
      html`${stands.length === 0 && html`<p class="muted">${t("drawer.none")}</p>`}${standCards(stands, session?.visits ?? [], writes)}`,
    );

    const visits = (session?.visits ?? []).slice(-3).reverse();
    render(
      one(".visits", el),
      html`${visits.length === 0 && html`<p class="muted">${t("drawer.none")}</p>`}${visits.map((visit) => visitLine(visit, session))}`,
    );
    const system = systemOf(session);
    const anomalies = (session?.anomalies ?? []).slice(-4).reverse();
    render(
      one(".anomalies", el),
      html`${anomalies.length === 0 && html`<p class="muted">${t("drawer.none")}</p>`}${anomalies.map(
        (a) =>
          html`<p class="alert-line">
            <b>${word(system, `anomaly.${a.anomaly}`)}</b>${streamOf(system, a) && ` · ${streamOf(system, a)}`}
            <span class="muted"
              >${whenOf(session, a.t_start_ns / 1e9)} · ${aboutAnomaly(system, a.anomaly)}
              ${sentence(system, `anomaly.told.${a.anomaly}`, a)}</span
            >
          </p>`,
      )}`,
    );
  }

  return {
    /** @param {Set<import("../app.js").AnyTopic>} _changed */
    update(_changed) {
      const person = current();
      el.hidden = !person;
      if (!person) {
        shown = null;
        return;
      }
      if (shown !== person.inspector.id) {
        build(person);
        shown = person.inspector.id;
      }
      fill(person);
    },
    close() {
      el.removeEventListener("click", onClick);
      faultForm?.then((form) => form.remove(), console.info);
      render(el, html``);
      el.hidden = true;
    },
  };
}

const loadFaultForm = () => import("../faults/form.js");

/** @type {Record<string, string>} */
const TONES = { accepted: "good", rejected: "bad", waiting: "" };

/**
 * How likely it is that none of those named is meant; or where that is, when it is likely.
 * @param {ReturnType<typeof rankPlaces<import("../app.js").Place>>} near
 */
function nearRest(near) {
  if (near.length === 0) return t("drawer.near_none");
  const rest = Math.max(0, 1 - near.reduce((sum, candidate) => sum + candidate.probability, 0));
  const [a, b] = near.toSorted((one, other) => one.distance_m - other.distance_m);
  if (rest <= 0.5 || !b) return t("drawer.near_rest", { share: percent(rest) });
  return t("drawer.between", { a: a.place.name, b: b.place.name, m: length(a.distance_m) });
}

/**
 * The time of day of a moment of a walk; since its start, where nobody knows when that was.
 * @param {import("../state/live.js").LiveSession | null} session
 * @param {number} t_s
 */
function whenOf(session, t_s) {
  return session?.started_at ? clock(Date.parse(session.started_at) + t_s * 1000) : elapsed(t_s);
}

/**
 * @param {import("../state/findings.js").Visit} visit
 * @param {import("../state/live.js").LiveSession | null} session
 */
function visitLine(visit, session) {
  const outcome = visitOutcome(visit);
  const off = offBefore(visit);
  return html`<p class="alert-line">
    <b>${visit.marker}</b> <span class="tag ${TONES[outcome]}">${t(`visit.${outcome}`)}</span>
    <span class="muted"
      >${whenOf(session, visitTime(visit))}${off !== null && html` · ${t("visit.moved", { m: length(off) })}`}</span
    >
  </p>`;
}
