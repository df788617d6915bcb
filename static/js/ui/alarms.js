// Alarms for those who listen: somebody is lost, a fault of high severity. Moves are never read aloud.

import { stands } from "../faults/states.js";
import { one } from "../html.js";
import { t } from "../i18n.js";

/** @param {import("../app.js").App} app */
export function makeAlarms(app) {
  const region = one("#alarms");
  /** @type {Set<string> | null} */
  let told = null;
  return {
    update() {
      /** @type {Map<string, string>} */
      const now = new Map();
      for (const person of app.people()) {
        if (person.presence === "lost")
          now.set(`lost ${person.inspector.id}`, t("alarm.lost", { name: person.inspector.name }));
      }
      for (const fault of app.live.faults.values()) {
        if (stands(fault) && fault.severity === "high") {
          now.set(
            `fault ${fault.id}`,
            t("alarm.fault", { marker: fault.marker ?? fault.candidates.find((c) => c.marker)?.marker ?? "?" }),
          );
        }
      }
      // What stood there when the page was opened is in the lists; only news is told.
      if (told !== null) {
        for (const [key, words] of now) {
          if (told.has(key)) continue;
          const line = document.createElement("p");
          line.textContent = words;
          region.replaceChildren(line);
        }
      }
      if (app.live.boot !== null) told = new Set(now.keys());
    },
  };
}
