// Says why something is not offered here: what the server would refuse, a person is told before.

import { html } from "../html.js";
import { t } from "../i18n.js";

/**
 * @param {import("../app.js").App} app
 * @param {"walk" | "administer"} right
 * @returns {{text: string} | null} null where they may
 */
export function forbidden(app, right) {
  const { me } = app;
  const role = me.role ? t(`role.${me.role}`) : "–";
  if (!app.may(right)) return notice(t(`may_not.${right}`, { role }));
  // An inspector's account writes the walks of the inspector that it belongs to.
  if (right === "walk" && me.inspector_id === null && !app.may("walk_for_others")) return notice(t("may_not.tied"));
  return null;
}

/** @param {string} words */
const notice = (words) => html`<p class="warning" role="note" data-testid="may-not">${words}</p>`;
