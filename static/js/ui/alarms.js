// Alarms: somebody is lost, a fault of high severity. They are read aloud when they are new, and stay on the screen until somebody has
// acknowledged them. Moves are never read aloud.

import { alarmsAcknowledged } from "../api.js";
import { one } from "../html.js";
import { t } from "../i18n.js";

/** @typedef {{key: string, words: string, inspector?: string, fault?: string}} Alarm */

/**
 * What is wrong now, by keys that are the same for everybody.
 * @param {import("../app.js").App} app
 * @returns {Alarm[]}
 */
export function alarmsOf(app) {
  /** @type {Alarm[]} */
  const found = [];
  for (const { presence, session, inspector } of app.people()) {
    // Whoever is heard of and lost again is another alarm.
    if (presence === "lost" && session)
      found.push({
        key: `lost:${session.id}:${session.position?.t_ns ?? 0}`,
        words: t("alarm.lost", { name: inspector.name }),
        inspector: inspector.id,
      });
  }
  for (const fault of app.live.faults.values()) {
    if (fault.state !== "open" || fault.severity !== "high") continue;
    const marker = fault.marker ?? fault.candidates.find((c) => c.marker)?.marker ?? "?";
    found.push({ key: `fault:${fault.id}`, words: t("alarm.fault", { marker }), fault: fault.id });
  }
  return found.filter(({ key }) => !app.live.acknowledged.has(key));
}

/** @param {import("../app.js").App} app */
export function makeAlarms(app) {
  const region = one("#alarms");
  /** @type {Set<string> | null} */
  let told = null;
  /** @type {string | null} */
  let boot = null;
  /** @type {ReturnType<typeof import("./alarm_panel.js").makePanel> | null} */
  let panel = null;
  let asked = false;
  return {
    update() {
      const { live } = app;
      if (live.boot === null) return;
      // Where changes may have been missed, all are asked for.
      if (boot !== live.boot) {
        boot = live.boot;
        alarmsAcknowledged().then((list) => {
          for (const row of list) live.acknowledged.set(row.key, row);
          app.changed("fault");
        }, console.info);
      }
      const now = alarmsOf(app);
      // What stood there when the page was opened is in the lists; only news is told.
      const news = told === null ? [] : now.filter(({ key }) => !told?.has(key));
      for (const { words } of news) {
        const line = document.createElement("p");
        line.textContent = words;
        region.replaceChildren(line);
      }
      told = new Set(now.map(({ key }) => key));
      if (now.length > 0 && !asked) {
        asked = true;
        loadPanel().then(
          ({ makePanel }) => (panel = makePanel(app)),
          () => (asked = false),
        );
      }
      panel?.show(now, news.length > 0);
    },
  };
}

const loadPanel = () => import("./alarm_panel.js");
