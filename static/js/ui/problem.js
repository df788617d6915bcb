// An error as the person needs it: what happened, where, and what to do.

import { Problem, Unreachable } from "../api.js";
import { html } from "../html.js";
import { t, tOr } from "../i18n.js";

/** @param {unknown} error */
export function problemBox(error) {
  if (error instanceof Problem) {
    return html`<div class="problem" role="alert" data-testid="problem">
      <b>${t("problem.refused")}</b>
      <p>${error.message}</p>
      ${error.where && html`<p class="muted">${t("problem.where")}: ${whereWords(error.where)}</p>`}
      ${error.code && html`<p class="mono muted">${error.status} ${error.code}</p>`}
    </div>`;
  }
  const words =
    error instanceof Unreachable ? t("problem.unreachable") : String(error instanceof Error ? error.message : error);
  return html`<div class="problem" role="alert" data-testid="problem">
    <b>${t("problem.failed")}</b>
    <p>${words}</p>
  </div>`;
}

/** @param {Record<string, unknown> | string} where */
function whereWords(where) {
  if (typeof where === "string") return where;
  return Object.entries(where)
    .map(([key, value]) => `${tOr(`problem.where.${key}`, key)} ${value}`)
    .join(", ");
}
