// What a survey may come to, before anybody has walked: the table of `lodestep predict survey --table`.

import { number } from "../format.js";
import { html } from "../html.js";
import { t } from "../i18n.js";
import { FORECASTS } from "./pole_forecasts.js";

/** The routes in the order in which they get harder for the same length. */
const ROUTES = ["I", "L", "U", "B"];

/** Sigmas at the point of each route by the length that has no sky. */
export function forecastTable() {
  const lengths = [...new Set(FORECASTS.map(({ metres }) => metres))].sort((a, b) => a - b);
  const of = (/** @type {string} */ route, /** @type {number} */ metres) =>
    FORECASTS.find((one) => one.route === route && one.metres === metres);
  return html`<details class="block" data-testid="forecast">
    <summary>${t("pole.plan")}</summary>
    <p class="muted">${t("pole.plan_explain")}</p>
    <div class="scroll" tabindex="0" role="region" aria-label="${t("pole.plan")}">
      <table>
        <thead>
          <tr>
            <th>${t("pole.plan_metres")}</th>
            ${ROUTES.map((route) => html`<th class="num">${t(`pole.plan_route.${route}`)}</th>`)}
          </tr>
        </thead>
        <tbody>
          ${lengths.map(
            (metres) =>
              html`<tr>
                <td>${number(metres, 0)} m</td>
                ${ROUTES.map((route) => {
                  const found = of(route, metres);
                  return html`<td class="num mono">
                    ${found ? `${number(found.plan_m, 3)} / ${number(found.up_m, 3)}` : "–"}
                  </td>`;
                })}
              </tr>`,
          )}
        </tbody>
      </table>
    </div>
    <p class="muted">${t("pole.plan_live")}</p>
  </details>`;
}
