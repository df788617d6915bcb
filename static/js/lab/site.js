// What walks are computed with: the set of parameters that was made the site's, or the defaults.

import { siteParametersFile } from "../api.js";
import { dateTime } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { exact } from "./parameters.js";

/**
 * @typedef {import("./parameters.js").ParameterSet} ParameterSet
 * @typedef {{
 *   id: number, set: {id: string, name: string, version: number} | null, parameters: Record<string, number>,
 *   chosen_at: string | null, chosen_by: string | null,
 * }} SiteParameters
 */

/**
 * @param {SiteParameters} site
 * @param {ParameterSet[]} sets
 * @param {ParameterSet | null} shown the set that can be made the site's, saved as it is shown
 * @param {boolean} mayTurn
 */
export function siteCard(site, sets, shown, mayTurn) {
  const { set, parameters, chosen_at, chosen_by } = site;
  const kept = set && sets.find((other) => other.id === set.id);
  const isShown = shown !== null && set?.id === shown.id && set.version === shown.version;
  return html`<h2>${t("lab.site")}</h2>
    <p class="state">
      ${set ? t("lab.site_is", { name: set.name, version: set.version }) : t("lab.site_is_default")}
      ${chosen_at && html`<span class="muted">${t("lab.site_since", { when: dateTime(chosen_at), who: chosen_by ?? t("lab.site_nobody") })}</span>`}
    </p>
    ${set && html`<p class="mono">${Object.entries(parameters).map(([key, value]) => html`<span class="tag">${key} = ${exact(value)}</span> `)}</p>`}
    ${set && !kept && html`<p class="muted">${t("lab.site_removed")}</p>`}
    ${set && kept && kept.version !== set.version && html`<p class="warn">${t("lab.site_older", { version: kept.version })}</p>`}
    <div class="row">
      ${mayTurn && html`<button type="button" data-make-site ${(shown === null || isShown) && "disabled"}>${t("lab.make_site")}</button><button type="button" data-site-default ${set === null && "disabled"}>${t("lab.site_default")}</button>`}<a
        class="button"
        href="${siteParametersFile}"
        download
        >${t("lab.site_file")}</a
      >
    </div>
    <p class="muted">${t("lab.site_when")}</p>`;
}
