// Is what the page shows of now? The link's state in the top bar, and a banner that says how old the data are.

import { clock, shortDuration } from "../format.js";
import { one, setAttribute, setText } from "../html.js";
import { t } from "../i18n.js";

/** Data older than this are called old even while the link seems up. */
const OLD_AFTER_MS = 5_000;

/**
 * @param {import("../app.js").App} app
 * @param {() => boolean} isUp whether the feed is open
 */
export function makeLinkState(app, isUp) {
  const badge = one("#link");
  const banner = one("#banner");
  const time = one("#clock");
  const openedAt = Date.now();

  return {
    update() {
      const now = Date.now();
      const up = isUp();
      const heard = app.live.heard_at_ms;
      const lost = heard > 0 ? !up || now - heard > OLD_AFTER_MS : now - openedAt > 5000;
      const state = lost ? "lost" : up ? "up" : "connecting";
      setAttribute(badge, "data-state", state);
      setText(/** @type {Element} */ (badge.lastElementChild), t(`link.${state}`));
      if (lost) {
        const words =
          heard > 0
            ? t("link.banner", {
                time: clock(heard + app.live.server_offset_ms),
                zone: t("zone"),
                age: shortDuration((now - heard) / 1000),
              })
            : t("link.never");
        setText(banner, words);
      }
      banner.hidden = !lost;
      const words = `${clock(now + app.live.server_offset_ms)}`;
      if (time.dataset.shown !== words + t("zone")) {
        time.dataset.shown = words + t("zone");
        const strong = document.createElement("b");
        strong.textContent = words;
        const zone = document.createElement("span");
        zone.textContent = ` ${t("zone")}`;
        time.replaceChildren(strong, zone);
      }
    },
  };
}
