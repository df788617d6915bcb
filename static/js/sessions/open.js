// The screen of one walk is the largest by far: it is fetched when somebody opens a walk or the list of them. What it
// shows is asked for at the same time.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { addWords, t } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/** Points a second of a long walk: one every metre and a half at walking pace. */
export const LEAST_RATE_HZ = 1;

/** Modules that the screen would only find out about one after the other. */
const DEEPER = [
  () => import("../replay/screen.js"),
  () => import("../replay/charts.js"),
  () => import("../replay/plot.js"),
  () => import("../replay/plots.js"),
  () => import("../replay/time_bar.js"),
  () => import("../replay/readout.js"),
  () => import("../replay/keys.js"),
  () => import("./figures.js"),
];
const SCREEN = () => import("./view.js");
const WORDS = () => addWords("sessions");

/** The screen's modules, all at once. */
export function fetchScreen() {
  // What fails here fails with the screen, which tells of it.
  for (const fetchIt of DEEPER) fetchIt().catch(() => {});
  return Promise.all([SCREEN(), WORDS()]).then(([screen]) => screen);
}

/** @param {string} id */
function askAbout(id) {
  const asked = {
    words: Promise.all([api.session(id), api.visits(id), api.anomalies(id), api.stands(id)]),
    coarse: api.track(id, "main", LEAST_RATE_HZ),
  };
  // The one who awaits them reports what is wrong with them.
  Object.values(asked).forEach((answer) => answer.catch(() => {}));
  return asked;
}

/** @typedef {ReturnType<typeof askAbout>} Asked the walk, its visits, anomalies and stands; and its track, coarsely */

/** @type {import("../ui/router.js").MakeView} */
export function openSession(app, side, id) {
  render(side, html`<div class="session"><p class="muted">${t("loading")}</p></div>`);
  /** @type {import("../ui/router.js").View | null} */
  let view = null;
  let gone = false;
  const asked = askAbout(id);
  fetchScreen().then(
    ({ sessionView }) => {
      if (!gone) view = sessionView(app, side, id, asked, () => askAbout(id));
    },
    (error) => {
      if (!gone) render(one(".session", side), problemBox(error));
    },
  );
  return {
    update: (changed) => view?.update?.(changed),
    close() {
      gone = true;
      view?.close?.();
    },
  };
}
