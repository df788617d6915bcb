// Alarms, as the server raises them: somebody is lost or has stood for long, a fault of high severity. They are read aloud when they are
// new, and stay on the screen until somebody has acknowledged them. Moves are never read aloud.

import { alarms, alarmsAcknowledged } from "../api.js";
import { clock } from "../format.js";
import { one } from "../html.js";
import { t } from "../i18n.js";

/** @typedef {{key: string, words: string, inspector?: string, fault?: string}} Alarm */

/**
 * Those that nobody has acknowledged.
 * @param {import("../app.js").App} app
 * @returns {Alarm[]}
 */
export function alarmsOf({ live }) {
  const open = [...live.alarms.values()].filter(({ key }) => !live.acknowledged.has(key));
  return open.map(({ key, kind, inspector_id, fault_id, since }) => {
    if (kind === "fault") {
      const fault = live.faults.get(fault_id ?? "");
      const marker = fault?.marker ?? fault?.candidates.find((c) => c.marker)?.marker ?? "?";
      return { key, words: t("alarm.fault", { marker }), fault: fault_id ?? undefined };
    }
    const name = live.inspectors.get(inspector_id ?? "")?.name ?? "?";
    return { key, words: t(`alarm.${kind}`, { name, time: clock(since) }), inspector: inspector_id ?? undefined };
  });
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
        Promise.all([alarms(), alarmsAcknowledged()]).then(([{ lost_after_s, gone_after_s }, list]) => {
          Object.assign(live, { lost_after_s, gone_after_s });
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
