// For administrators: accounts, everybody's tokens, webhooks, who changed what, jobs, the server's health.

import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { forbidden } from "../ui/forbidden.js";
import { showTokens } from "../account/tokens.js";
import { showAccounts } from "./accounts.js";
import { showAudit } from "./audit.js";
import { showServer } from "./server.js";
import { showWebhooks } from "./webhooks.js";

/** @type {Record<string, (app: import("../app.js").App, box: HTMLElement) => void>} */
const PARTS = {
  accounts: showAccounts,
  tokens: (app, box) => showTokens(app, box, true),
  webhooks: showWebhooks,
  audit: showAudit,
  server: showServer,
};

/** @type {import("../ui/router.js").MakeView} */
export function adminView(app, side, argument) {
  const refused = forbidden(app, "administer");
  if (refused) {
    render(
      side,
      html`<div class="page">
        <h1>${t("nav.admin")}</h1>
        ${refused}
      </div>`,
    );
    return {};
  }
  const part = Object.hasOwn(PARTS, argument) ? argument : "accounts";
  render(
    side,
    html`<div class="page">
      <h1>${t("nav.admin")}</h1>
      <nav class="parts" aria-label="${t("nav.admin")}">
        ${Object.keys(PARTS).map((name) => html`<a href="#/admin/${name}" ${name === part ? "aria-current=page" : ""}>${t(`admin.${name}`)}</a>`)}
      </nav>
      <div class="block" data-testid="admin-${part}"></div>
    </div>`,
  );
  PARTS[part](app, one(".block", side));
  return {};
}
