// The alarms that nobody has acknowledged, over the map: who sees to one says so by name, for everybody.

import { acknowledgeAlarm } from "../api.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { recall, remember } from "./remembered.js";

/** More than these nobody reads at once. */
const SHOWN = 5;
const TONE_HZ = 880;
const TONE_S = 0.25;

/** @param {import("../app.js").App} app */
export function makePanel(app) {
  const el = document.createElement("section");
  el.id = "alarm-panel";
  el.dataset.testid = "alarm-panel";
  one("#main").append(el);
  let sound = recall("alarm-sound") === "yes";
  let folded = recall("alarms-folded") === "yes";
  /** @type {import("./alarms.js").Alarm[]} */
  let shown = [];

  function draw() {
    el.hidden = shown.length === 0;
    el.setAttribute("aria-label", t("alarm.title"));
    render(
      el,
      html`<header>
          <button type="button" class="quiet grow" data-fold aria-expanded="${String(!folded)}">
            <b>${t("alarm.n", { n: shown.length })}</b>
          </button>
          <button type="button" class="quiet" data-sound aria-pressed="${String(sound)}">${t("alarm.sound")}</button>
        </header>
        ${
          !folded &&
          html`<ul>
            ${shown.slice(0, SHOWN).map(line)}
          </ul>`
        }
        ${!folded && shown.length > SHOWN && html`<p class="muted">${t("alarm.more", { n: shown.length - SHOWN })}</p>`}
        <p class="answer" role="status"></p>`,
    );
  }

  /** @param {import("./alarms.js").Alarm} alarm */
  const line = ({ key, words }) =>
    html`<li>
      <button type="button" class="quiet grow" data-alarm="${key}">${words}</button>
      ${app.may("dispatch") && html`<button type="button" data-acknowledge="${key}">${t("alarm.acknowledge")}</button>`}
    </li>`;

  el.addEventListener("click", async (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const read = (/** @type {string} */ name) => target.closest(`[data-${name}]`)?.getAttribute(`data-${name}`);
    if (target.closest("[data-fold]")) {
      folded = !folded;
      remember("alarms-folded", folded ? "yes" : null);
      return draw();
    }
    if (target.closest("[data-sound]")) {
      sound = !sound;
      remember("alarm-sound", sound ? "yes" : null);
      if (sound) beep();
      return draw();
    }
    const key = read("acknowledge");
    if (key) {
      try {
        const row = await acknowledgeAlarm(key);
        app.live.acknowledged.set(row.key, row);
        app.changed("fault");
      } catch (/** @type {any} */ error) {
        one(".answer", el).textContent = String(error.message);
      }
      return;
    }
    const alarm = shown.find((one) => one.key === read("alarm"));
    if (alarm?.inspector) app.select(alarm.inspector);
    if (!alarm?.fault) return;
    app.ui.fault = alarm.fault;
    const place = app.live.faults.get(alarm.fault)?.position_m;
    if (place) app.stage.goTo([place[0], place[1]], 2);
    app.changed("choice");
  });

  return {
    /**
     * @param {import("./alarms.js").Alarm[]} alarms
     * @param {boolean} news
     */
    show(alarms, news) {
      shown = alarms;
      if (news && sound) beep();
      draw();
    },
  };
}

/** A short tone; a browser that lets a page make none before it was touched stays silent. */
function beep() {
  try {
    const audio = new AudioContext();
    const tone = audio.createOscillator();
    tone.frequency.value = TONE_HZ;
    tone.connect(audio.destination);
    tone.start();
    tone.stop(audio.currentTime + TONE_S);
    tone.onended = () => audio.close();
  } catch {
    // There is no sound here.
  }
}
