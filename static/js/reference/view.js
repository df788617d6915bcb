// The API, as the server describes it: every route with who may, what it takes and what it gives; and a client in ten
// lines. Read from /api/v1/openapi.json, so that it works where there is no internet and is never out of date.

import { openapi } from "../api.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { keyOf, systemNamed } from "../systems/index.js";
import { givesOf, refusesOf, shapeLines } from "./shape.js";

/** @typedef {{method: string, path: string, about: string, right: string, takes: any, gives: any, refuses: string[], parameters: any[]}} Route */

/** @type {import("../ui/router.js").MakeView} */
export function referenceView(_app, side) {
  const system = systemNamed();
  render(
    side,
    html`<div class="page reference">
      <h1 data-t="reference.title"></h1>
      <p class="lead">
        <span data-t="reference.lead"></span> <a href="/api/v1/openapi.json" download data-t="reference.file"></a>
      </p>
      <div class="block" ${system.clients === null && "hidden"}>
        <h2 data-t="reference.client"></h2>
        <p class="muted" data-t="${keyOf(system, "reference.client_how")}"></p>
        <div class="clients"></div>
      </div>
      <input type="search" data-t-hint="reference.search" data-t-label="reference.search" autocomplete="off" />
      <div class="routes" data-testid="routes"><p class="muted" data-t="loading"></p></div>
    </div>`,
  );
  translate(side);
  const search = /** @type {HTMLInputElement} */ (one("input", side));
  /** @type {Route[]} */
  let routes = [];
  /** @type {any} */
  let document_ = {};
  let gone = false;

  system.clients?.().then(
    ({ clients }) =>
      gone ||
      render(
        one(".clients", side),
        html`${clients(location.origin).map(
          ([name, lines]) =>
            html`<h3>${name}</h3>
              <pre class="mono" tabindex="0">${lines}</pre>`,
        )}`,
      ),
    (error) => gone || render(one(".clients", side), problemBox(error)),
  );

  function show() {
    const wanted = search.value.trim().toLowerCase();
    const found = routes.filter((r) => `${r.method} ${r.path} ${r.about}`.toLowerCase().includes(wanted));
    render(
      one(".routes", side),
      html`${found.map(
        (r) =>
          html`<details class="block">
            <summary>
              <b class="mono">${r.method}</b> <span class="mono">${r.path}</span><span class="muted"> ${r.about}</span>
            </summary>
            <p>${t("reference.who")}: ${r.right ? t(`right.${r.right}`) : t("reference.anybody")}</p>
            ${
              r.parameters.length > 0 &&
              html`<h3>${t("reference.parameters")}</h3>
                <pre class="mono">
${r.parameters.map((p) => `${p.name}${p.required ? "" : "?"}  ${shapeLines(p.schema, document_).join(" ")}  ${p.description ?? ""}`).join("\n")}</pre>`
            }
            ${
              r.takes &&
              html`<h3>${t("reference.takes")}</h3>
                ${bodyOf(r.takes)}`
            }
            ${
              r.gives &&
              html`<h3>${t("reference.gives")}</h3>
                ${bodyOf(r.gives)}`
            }
            ${
              r.refuses.length > 0 &&
              html`<h3>${t("reference.refuses")}</h3>
                <pre class="mono" tabindex="0">${r.refuses.join("\n")}</pre>`
            }
          </details>`,
      )}`,
    );
  }

  /** @param {Record<string, {schema: any}>} content */
  function bodyOf(content) {
    return Object.entries(content).map(
      ([kind, { schema }]) =>
        html`<pre class="mono" tabindex="0">
${kind === "application/json" ? shapeLines(schema, document_).join("\n") : kind}</pre>`,
    );
  }

  search.addEventListener("input", show);
  openapi().then(
    (found) => {
      if (gone) return;
      document_ = found;
      routes = Object.entries(found.paths).flatMap(([path, methods]) =>
        Object.entries(/** @type {Record<string, any>} */ (methods)).map(([method, o]) => ({
          method: method.toUpperCase(),
          path,
          about: o.summary,
          right: o["x-right"] ?? "",
          parameters: o.parameters ?? [],
          takes: o.requestBody?.content,
          gives: givesOf(o.responses),
          refuses: refusesOf(o.responses, found),
        })),
      );
      show();
    },
    (error) => {
      if (!gone) render(one(".routes", side), problemBox(error));
    },
  );
  return {
    close() {
      gone = true;
    },
  };
}
