// The inspector's own page, for a small screen or a kiosk: start and stop, a number pad for the actuator, a
// fault; all of it also without a link.

import * as api from "../api.js";
import { FAULT_KINDS } from "../faults/form.js";
import { duration, length, percent } from "../format.js";
import { html, one, render, setAttribute, setText } from "../html.js";
import { t, translate } from "../i18n.js";
import { forbidden } from "../ui/forbidden.js";
import { people, serverNow } from "../state/attention.js";
import { inspectorsOf } from "../state/live.js";
import * as storage from "../ui/remembered.js";
import { rememberUpload, unfinishedUpload } from "../upload/remembered_upload.js";
import { keepShell } from "./offline.js";
import { newId, Outbox } from "./outbox.js";
import {
  changePerson,
  chips,
  doubt,
  firstLetters,
  press,
  recallMine,
  rememberMine,
  UNDO_MS,
  visitTimes,
} from "./walk.js";

const SEVERITIES = /** @type {const} */ (["low", "medium", "high"]);
/** Stop waits so long for being pressed once more; two taps within the other are one. */
const STOP_WAITS_MS = 5_000;
const ONE_TAP_MS = 1_500;
/** How often what waits is tried again without any sign of a link, ms. */
const TRY_EVERY_MS = 15_000;

/** @type {import("../ui/router.js").MakeView} */
export function meView(app, side) {
  const mine = recallMine(storage);
  // An account that is signed in as an inspector is that inspector, and no other.
  const own = app.me.inspector_id;
  if (own !== null && mine.inspector_id !== own) {
    changePerson(mine, own);
  }
  let typed = "";
  /** Since when Stop waits to be pressed once more, ms; a glove that brushes it ends no walk. */
  let stopping_ms = -Infinity;
  /** When the last fault was reported, ms. */
  let reported_ms = -Infinity;
  /** What was doubted is entered when it is pressed again. */
  let doubted = "";
  const outbox = new Outbox(api, storage, {
    onChange: () => show(),
    onSent(entry, answer) {
      if (entry.kind !== "visit") return;
      const keyed = mine.keyed.find((k) => k.id === entry.id);
      const visit = answer?.visits?.find(
        (/** @type {any} */ v) =>
          v.marker === entry.body.marker && Math.abs(v.t_start_ns - entry.body.t_start_s * 1e9) < 1e6,
      );
      if (!keyed || !visit) return;
      keyed.visit_id = visit.id;
      save();
      // Taken back while it was under way.
      if (keyed.undone) sendTakeBack(keyed);
    },
  });

  const letters = firstLetters(app.plan.nodes.map((node) => node.name));
  const key = (/** @type {string} */ name, /** @type {string} */ label, /** @type {string} */ words) =>
    html`<button type="button" class="key" data-key="${name}" ${words && html`aria-label="${t(words)}"`}>
      ${label}
    </button>`;
  render(
    side,
    html`<div class="me" data-testid="me">
      <h1 class="unseen" data-t="me.title"></h1>
      ${forbidden(app, "walk")}
      <section class="who">
        <label class="field"
          ><span data-t="me.who"></span
          ><select name="who" data-testid="me-who"></select
        ></label>
        <div class="sharing" data-testid="me-sharing"></div>
        <div class="walk-state">
          <p class="state" role="status" data-testid="me-state"></p>
          <button type="button" class="walk" data-testid="me-walk"></button>
        </div>
      </section>
      <section class="at">
        <h2 data-t="me.at"></h2>
        <div class="chips" data-testid="me-chips"></div>
        <div class="said">
          <output class="typed" data-testid="me-typed"></output>
          <p class="check" role="status" data-testid="me-check"></p>
        </div>
        <div class="pad">
          ${letters.length > 0 && html`<div class="letters">${letters.map((l) => key(l, l, ""))}</div>`}
          <div class="digits">
            ${["1", "2", "3", "4", "5", "6", "7", "8", "9"].map((d) => key(d, d, ""))}${key("clear", "✕", "me.clear")}${key("0", "0", "")}${key("back", "⌫", "me.back")}
          </div>
          <button type="button" class="main-action enter" data-testid="me-enter"></button>
        </div>
      </section>
      <section class="told">
        <h2 data-t="me.told"></h2>
        <ul class="keyed" data-testid="me-keyed"></ul>
      </section>
      <section class="fault">
        <details data-testid="me-fault">
          <summary data-t="me.fault"></summary>
          <form novalidate>
            <label class="field"
              ><span data-t="fault.kind"></span
              ><select name="kind">
                ${FAULT_KINDS.map((k) => html`<option value="${k}">${t(`fault.kind.${k}`)}</option>`)}
              </select></label
            >
            <fieldset>
              <legend data-t="fault.severity"></legend>
              <div class="choices">
                ${SEVERITIES.map((s) => html`<label><input type="radio" name="severity" value="${s}" ${s === "medium" && "checked"} /><span>${t(`severity.${s}`)}</span></label>`)}
              </div>
            </fieldset>
            <label class="field"
              ><span data-t="me.fault_marker"></span
              ><input name="marker" autocomplete="off" autocapitalize="characters" spellcheck="false"
            /></label>
            <label class="field"
              ><span data-t="fault.text"></span><textarea name="text" maxlength="2000" rows="3"></textarea>
            </label>
            <p class="answer" role="status"></p>
            <button class="main-action" data-testid="me-report" data-t="fault.send"></button>
          </form>
        </details>
      </section>
      <section class="outbox" data-testid="me-outbox">
        <p class="waits" role="status"></p>
        <ul></ul>
        <p class="muted offline"></p>
      </section>
    </div>`,
  );
  translate(side);

  const who = /** @type {HTMLSelectElement} */ (one("[name=who]", side));
  const walkButton = /** @type {HTMLButtonElement} */ (one("button.walk", side));
  const enter = /** @type {HTMLButtonElement} */ (one(".enter", side));
  const form = /** @type {HTMLFormElement} */ (one("form", side));

  const save = () => rememberMine(storage, mine);
  const now = () => serverNow(app.live, Date.now());
  /** The walk that a device streams for this inspector, if it does. */
  const liveSession = () =>
    people(app.live, Date.now()).find((p) => p.inspector.id === mine.inspector_id)?.session ?? null;

  /** The walk that visits belong to: the streamed one before one that was begun here. */
  function walk() {
    const live = liveSession();
    if (live?.started_at) return { id: live.id, started_ms: Date.parse(live.started_at), live: true, session: live };
    return mine.walk ? { ...mine.walk, session: app.live.sessions.get(mine.walk.id) ?? null } : null;
  }

  /** What speaks for or against a place, and the places to offer. */
  function known() {
    const current = walk();
    const position = current?.live ? (current.session?.position ?? null) : null;
    const last = [...mine.keyed].reverse().find((k) => !k.undone && k.session_id === current?.id);
    const place = last && app.grid.named(last.marker);
    return {
      position,
      last: last && place ? { place, ago_s: (now() - last.at_ms) / 1000 } : null,
      stand: current?.live ? current.session?.stands.find((s) => s.lasts) : undefined,
    };
  }

  function showWho() {
    const list = inspectorsOf(app.live);
    const names = (list.length > 0 ? list : storedInspectors()).filter((i) => app.writesFor(i.id));
    if (list.length > 0) storage.remember("inspectors", JSON.stringify(list.map(({ id, name }) => ({ id, name }))));
    render(
      who,
      html`<option value="">${t("me.choose")}</option>
        ${names.map((i) => html`<option value="${i.id}">${i.name}</option>`)}`,
    );
    if (names.some((i) => i.id === mine.inspector_id)) who.value = mine.inspector_id;
  }

  function show() {
    const current = walk();
    const { position, last, stand } = known();
    const state = one(".state", side);
    setText(
      state,
      !mine.inspector_id
        ? t("me.state.nobody")
        : !current
          ? mine.ended
            ? t("me.state.ended")
            : t("me.state.idle")
          : t(current.live ? "me.state.live" : "me.state.walking", {
              time: duration((now() - current.started_ms) / 1000),
            }),
    );
    walkButton.hidden = current?.live ?? false;
    walkButton.disabled = !mine.inspector_id;
    const sure = current !== null && now() - stopping_ms < STOP_WAITS_MS;
    setText(walkButton, t(!current ? "me.start" : sure ? "me.stop_sure" : "me.stop"));
    walkButton.dataset.kind = current ? "stop" : "start";

    setText(one(".typed", side), typed || "–");
    const place = app.grid.named(typed);
    const check = one(".check", side);
    const against = place ? doubt(place, { position, last }) : null;
    const words =
      typed === ""
        ? current
          ? ""
          : t("me.start_hint")
        : !place
          ? t("me.unknown", { marker: typed })
          : against
            ? t(`me.doubt.${against.key}`, { metres: length(against.metres) })
            : t("me.known", { e: place.e_m.toFixed(1), n: place.n_m.toFixed(1) });
    setText(check, words);
    setAttribute(check, "data-tone", typed && !place ? "bad" : against ? "warn" : null);
    setText(enter, t(against && doubted === typed ? "me.enter_anyway" : "me.enter"));
    enter.disabled = !place || !current;

    const near = position ? position.position_m : last ? [last.place.e_m, last.place.n_m] : null;
    render(
      one(".chips", side),
      html`${chips(stand, near, (e, n, k) => app.grid.nearest(e, n, k)).map((c) => html`<button type="button" class="chip" data-chip="${c.marker}"><b>${c.marker}</b> <small>${c.distance_m !== null && length(c.distance_m)}${c.probability !== null && ` ${percent(c.probability)}`}</small></button>`)}`,
    );
    showSharing();
    showKeyed(current);
    showOutbox();
  }

  /** The others who are out and share this device. */
  function showSharing() {
    const names = new Map([...who.options].map((option) => [option.value, option.textContent ?? ""]));
    render(
      one(".sharing", side),
      html`${Object.entries(mine.others).map(([id, own]) => own.walk && html`<button type="button" class="chip" data-person="${id}"><b>${names.get(id) ?? "–"}</b> <small>${duration((now() - own.walk.started_ms) / 1000)}</small></button>`)}`,
    );
  }

  /** @param {ReturnType<typeof walk>} current */
  function showKeyed(current) {
    const waiting = new Set(outbox.entries().map((entry) => entry.id));
    const rows = mine.keyed
      .filter((k) => !current || k.session_id === current.id)
      .slice(-5)
      .reverse();
    render(
      one(".keyed", side),
      html`${rows.map((k) => {
        const remaining_s = Math.ceil((UNDO_MS - (now() - k.at_ms)) / 1000);
        const visit = app.live.sessions.get(k.session_id)?.visits.find((v) => v.id === k.visit_id);
        const rejected = !k.undone && visit?.accepted === false;
        const word = k.undone
          ? "undone"
          : rejected
            ? "rejected"
            : waiting.has(k.id)
              ? "waits"
              : visit?.accepted
                ? "accepted"
                : "sent";
        return html`<li data-state="${word}">
          <b>${k.marker}</b>
          <span class="tag ${rejected ? "bad" : word === "accepted" ? "good" : ""}">${t(`me.keyed.${word}`)}</span>
          ${rejected && html`<p class="warning" role="alert">${t("me.not_here", { marker: k.marker, reason: visit?.reason ?? "" })}</p>`}
          ${!k.undone && remaining_s > 0 && html`<button type="button" data-undo="${k.id}">${t("me.undo", { s: remaining_s })}</button>`}
        </li>`;
      })}`,
    );
    one(".told", side).hidden = rows.length === 0;
  }

  function showOutbox() {
    const entries = outbox.entries();
    setText(one(".waits", side), entries.length === 0 ? t("me.all_sent") : t("me.waits", { n: entries.length }));
    setAttribute(one(".outbox", side), "data-waiting", entries.length > 0 ? "yes" : null);
    render(
      one(".outbox ul", side),
      html`${entries.map(
        (entry) =>
          html`<li data-entry="${entry.kind}">
            ${t(`me.entry.${entry.kind}`)} ${entry.body.marker ?? ""}
            ${
              entry.refused &&
              html`<p class="warning" role="alert">${entry.refused}</p>
                <button type="button" data-drop="${entry.id}">${t("me.drop")}</button>`
            }
          </li>`,
      )}`,
    );
  }

  function startWalk() {
    const id = newId();
    const started_ms = now();
    const place = app.grid.named(typed);
    mine.walk = { id, started_ms, live: false };
    mine.ended = null;
    mine.keyed = [];
    save();
    outbox.add({
      id,
      kind: "walk",
      at_ms: started_ms,
      body: {
        inspector_id: mine.inspector_id,
        started_at: new Date(started_ms).toISOString(),
        ...(place ? { start: { marker: place.name } } : {}),
      },
    });
    typed = "";
    show();
  }

  function stopWalk() {
    if (!mine.walk) return;
    if (now() - stopping_ms >= STOP_WAITS_MS) {
      stopping_ms = now();
      return show();
    }
    stopping_ms = -Infinity;
    mine.ended = { id: mine.walk.id };
    // At this device the upload goes on with this walk, unless another one was cut. Where several share it, the dock asks.
    if (!unfinishedUpload() && Object.keys(mine.others).length === 0) {
      const started_at = new Date(mine.walk.started_ms).toISOString();
      const name = who.selectedOptions[0]?.textContent ?? "";
      rememberUpload({ session_id: mine.walk.id, title: "", logs: {}, waits: true, who: name, started_at });
    }
    mine.walk = null;
    save();
    show();
  }

  function enterMarker() {
    const place = app.grid.named(typed);
    const current = walk();
    if (!place || !current) return;
    const { position, last, stand } = known();
    if (doubt(place, { position, last }) && doubted !== typed) {
      doubted = typed;
      return show();
    }
    const at_ms = now();
    const times = visitTimes(current.started_ms, at_ms, stand ? [stand] : []);
    const id = newId();
    mine.keyed.push({
      id,
      marker: place.name,
      at_ms,
      session_id: current.id,
      t_start_ns: times.t_start_s * 1e9,
      visit_id: null,
      undone: false,
    });
    save();
    typed = "";
    doubted = "";
    outbox.add({ id, kind: "visit", at_ms, body: { session_id: current.id, marker: place.name, ...times } });
    show();
  }

  /** @param {string} id */
  function undo(id) {
    const keyed = mine.keyed.find((k) => k.id === id);
    if (!keyed || keyed.undone) return;
    keyed.undone = true;
    save();
    if (!outbox.drop(id)) sendTakeBack(keyed);
    show();
  }

  /** @param {import("./walk.js").Keyed} keyed */
  function sendTakeBack(keyed) {
    // Under way still: its answer takes it back.
    if (keyed.visit_id === null) return;
    outbox.add({
      id: newId(),
      kind: "take_back",
      at_ms: now(),
      body: { session_id: keyed.session_id, visit_id: keyed.visit_id, marker: keyed.marker },
    });
  }

  function reportFault() {
    const data = new FormData(form);
    const answer = one(".answer", form);
    const given = String(data.get("marker") ?? "").trim();
    const place = given ? app.grid.named(given) : null;
    if (!mine.inspector_id) return setText(answer, t("me.state.nobody"));
    if (given && !place) return setText(answer, t("me.unknown", { marker: given }));
    const at_ms = now();
    // A double tap is one fault.
    if (at_ms - reported_ms < ONE_TAP_MS) return;
    reported_ms = at_ms;
    const current = walk();
    const text = String(data.get("text") ?? "").trim();
    outbox.add({
      id: newId(),
      kind: "fault",
      at_ms,
      body: {
        ...(current ? { session_id: current.id } : { inspector_id: mine.inspector_id }),
        reported_at: new Date(at_ms).toISOString(),
        kind: data.get("kind"),
        severity: data.get("severity"),
        ...(text ? { text } : {}),
        ...(place ? { marker: place.name } : {}),
      },
    });
    form.reset();
    setText(answer, t("me.fault_taken"));
    show();
  }

  who.addEventListener("change", () => {
    changePerson(mine, who.value);
    typed = "";
    save();
    show();
  });
  walkButton.addEventListener("click", () => (walkButton.dataset.kind === "stop" ? stopWalk() : startWalk()));
  enter.addEventListener("click", enterMarker);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    reportFault();
  });
  one(".me", side).addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("button");
    if (!button) return;
    const { key: pressed, chip, undo: undone, drop, person } = button.dataset;
    if (pressed) typed = press(typed, pressed);
    else if (chip) typed = chip;
    else if (undone) undo(undone);
    else if (drop) outbox.drop(drop);
    else if (person) {
      changePerson(mine, person);
      who.value = person;
      save();
    } else return;
    if (pressed || chip) doubted = "";
    show();
  });
  // A keyboard is a pad, too; where something is typed into a field it belongs there.
  const onKey = (/** @type {KeyboardEvent} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.metaKey || event.altKey || target.closest("input, textarea, select")) return;
    if (/^[0-9a-z]$/iu.test(event.key)) typed = press(typed, event.key.toUpperCase());
    else if (event.key === "Backspace") typed = press(typed, "back");
    else if (event.key === "Enter" && !target.closest("button, summary, a")) enterMarker();
    else return;
    // Letters are no shortcuts here.
    event.stopPropagation();
    show();
  };
  document.addEventListener("keydown", onKey, true);
  const again = () => {
    outbox.flush();
    keep();
  };
  addEventListener("online", again);
  const trying = setInterval(() => outbox.flush(), TRY_EVERY_MS);

  showWho();
  show();
  outbox.flush();
  const offline = one(".offline", side);
  let kept = false;
  const keep = async () => {
    if (kept) return;
    kept = await keepShell();
    setText(offline, t(kept ? "me.works_offline" : "me.stay_open"));
  };
  keep();
  return {
    update(changed) {
      if (changed.has("all") || changed.has("session")) showWho();
      if (changed.has("link") || changed.has("all")) outbox.flush();
      show();
    },
    close() {
      document.removeEventListener("keydown", onKey, true);
      removeEventListener("online", again);
      clearInterval(trying);
    },
  };
}

/** @returns {{id: string, name: string}[]} */
function storedInspectors() {
  try {
    const found = JSON.parse(storage.recall("inspectors") ?? "[]");
    return Array.isArray(found) ? found : [];
  } catch {
    return [];
  }
}
