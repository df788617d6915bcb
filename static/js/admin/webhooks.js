// Webhooks: which programs are told of faults and anomalies, whether that arrives, and what they answered.

import * as api from "../api.js";
import { onSubmit, text } from "../account/view.js";
import { dateTime } from "../format.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { makeAttempt } from "./attempt.js";

/**
 * @typedef {{id: string, name: string, url: string, events: string[], enabled: boolean, disabled_why: string | null, failing_since: string | null, version: number}} Webhook
 * @typedef {{id: number, event_id: string, event: string, body: string, state: string, tries: number, next_at: string | null, tried_at: string | null, took_ms: number | null, status: number | null, answer: string | null, created_at: string}} Delivery
 */

const EVENTS = ["fault.reported", "fault.changed", "anomalies.found", "alarm.raised", "alarm.acknowledged"];
/** A delivery that was just asked for is looked at again, ms. */
const LOOKS_MS = [400, 1500, 4000];
/** @type {Record<string, string>} */
const TONES = { delivered: "good", failed: "bad", waiting: "" };

/**
 * @param {import("../app.js").App} _app
 * @param {HTMLElement} box
 */
export function showWebhooks(_app, box) {
  render(
    box,
    html`<h2>${t("admin.webhooks")}</h2>
      <p class="muted">${t("admin.webhook.lead")}</p>
      <div class="answer" aria-live="polite"></div>
      <div class="list"></div>
      <form data-draft class="new-webhook">
        <h3>${t("admin.webhook.new")}</h3>
        <div class="two">
          <label class="field"
            ><span>${t("admin.webhook.name")}</span><input name="name" maxlength="80" autocomplete="off" required
          /></label>
          <label class="field"
            ><span>${t("admin.webhook.url")}</span
            ><input name="url" type="url" maxlength="2000" autocomplete="off" required
          /></label>
        </div>
        <fieldset>
          <legend>${t("admin.webhook.events")}</legend>
          <div class="choices">
            ${EVENTS.map((event) => html`<label><input type="checkbox" name="event" value="${event}" checked /><span>${t(`admin.webhook.event.${event}`)}</span></label>`)}
          </div>
        </fieldset>
        <div class="answer" aria-live="polite"></div>
        <div class="row end"><button>${t("admin.webhook.register")}</button></div>
      </form>`,
  );
  const list = one(".list", box);
  const answer = one(".answer", box);
  /** @type {Webhook[]} */
  let hooks = [];
  /** @type {string | null} whose deliveries are shown */
  let open = null;

  async function show() {
    try {
      hooks = await api.webhooks();
      const deliveries = open === null ? [] : await api.webhookDeliveries(open);
      render(
        list,
        hooks.length === 0
          ? html`<p class="muted">${t("admin.webhook.none")}</p>`
          : html`<table class="webhooks" data-testid="webhooks">
              <thead>
                <tr>
                  <th>${t("admin.webhook.name")}</th>
                  <th>${t("admin.webhook.events")}</th>
                  <th>${t("admin.webhook.state")}</th>
                  <th><span class="unseen">${t("admin.change")}</span></th>
                </tr>
              </thead>
              <tbody>
                ${hooks.map(
                  (hook) =>
                    html`<tr data-webhook="${hook.id}">
                        <td><b>${hook.name}</b><br /><span class="mono muted">${hook.url}</span></td>
                        <td>${hook.events.map((event) => t(`admin.webhook.event.${event}`)).join(", ")}</td>
                        <td>${state(hook)}</td>
                        <td class="num">
                          <button type="button" data-do="test" ${!hook.enabled && "disabled"}>
                            ${t("admin.webhook.test")}
                          </button>
                          <button type="button" data-do="deliveries" aria-expanded="${String(hook.id === open)}">
                            ${t("admin.webhook.deliveries")}
                          </button>
                          <button type="button" data-do="switch">
                            ${t(hook.enabled ? "admin.webhook.switch_off" : "admin.webhook.switch_on")}
                          </button>
                          <button type="button" data-do="secret">${t("admin.webhook.new_secret")}</button>
                          <button type="button" data-do="remove">${t("admin.remove")}</button>
                        </td>
                      </tr>
                      ${
                        hook.id === open &&
                        html`<tr>
                          <td colspan="4">${deliveryList(deliveries)}</td>
                        </tr>`
                      }`,
                )}
              </tbody>
            </table>`,
      );
    } catch (error) {
      render(list, problemBox(error));
    }
  }

  const attempt = makeAttempt(answer, show);

  /** @param {{secret: string}} made */
  function showSecret(made) {
    render(
      answer,
      html`<div class="done" role="status">
        <b>${t("admin.webhook.secret_once")}</b>
        <p class="mono" data-testid="webhook-secret">${made.secret}</p>
      </div>`,
    );
  }

  /** What was sent just now is answered soon. */
  function lookAgain() {
    for (const wait_ms of LOOKS_MS) setTimeout(() => box.isConnected && show(), wait_ms);
  }

  list.addEventListener("click", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const again = target.closest("[data-again]")?.getAttribute("data-again");
    if (again && open !== null) {
      const id = open;
      attempt(() => api.sendAgain(id, Number(again)).then(lookAgain));
      return;
    }
    const what = target.closest("[data-do]")?.getAttribute("data-do");
    const hook = hooks.find((h) => h.id === target.closest("[data-webhook]")?.getAttribute("data-webhook"));
    if (!hook) return;
    if (what === "test") {
      open = hook.id;
      attempt(() => api.testWebhook(hook.id).then(lookAgain));
    }
    if (what === "deliveries") {
      open = open === hook.id ? null : hook.id;
      show();
    }
    if (what === "switch") attempt(() => api.changeWebhook(hook.id, { enabled: !hook.enabled, version: hook.version }));
    if (what === "secret" && confirm(t("admin.webhook.new_secret_sure", { name: hook.name })))
      attempt(() => api.renewWebhookSecret(hook.id).then(showSecret));
    if (what === "remove" && confirm(t("admin.webhook.remove_sure", { name: hook.name })))
      attempt(() => api.removeWebhook(hook.id));
  });
  onSubmit(one("form", box), async (data, form) => {
    const made = await api.addWebhook({
      name: text(data, "name"),
      url: text(data, "url"),
      events: data.getAll("event"),
    });
    /** @type {HTMLFormElement} */ (form).reset();
    showSecret(made);
    await show();
  });
  show();
}

/** @param {Webhook} hook */
function state(hook) {
  if (!hook.enabled)
    return html`<span class="tag ${hook.disabled_why && "bad"}">${t("admin.webhook.off")}</span
      >${hook.disabled_why && html`<br /><span class="bad" role="alert">${hook.disabled_why}</span>`}`;
  if (hook.failing_since)
    return html`<span class="tag warn">${t("admin.webhook.failing")}</span><br /><span class="muted"
        >${t("admin.webhook.failing_since", { time: dateTime(hook.failing_since) })}</span
      >`;
  return html`<span class="tag good">${t("admin.webhook.on")}</span>`;
}

/** @param {Delivery[]} deliveries */
function deliveryList(deliveries) {
  if (deliveries.length === 0) return html`<p class="muted">${t("admin.webhook.no_deliveries")}</p>`;
  return html`<div class="scroll" tabindex="0" role="region" aria-label="${t("admin.webhook.deliveries")}">
    <table data-testid="deliveries">
      <thead>
        <tr>
          <th>${t("admin.audit.when")}</th>
          <th>${t("admin.webhook.event")}</th>
          <th>${t("admin.webhook.state")}</th>
          <th class="num">${t("admin.webhook.tries")}</th>
          <th>${t("admin.webhook.last_answer")}</th>
          <th><span class="unseen">${t("admin.webhook.again")}</span></th>
        </tr>
      </thead>
      <tbody>
        ${deliveries.map(
          (d) =>
            html`<tr>
              <td>${dateTime(d.created_at)}</td>
              <td>
                ${t(`admin.webhook.event.${d.event}`)}
                <details>
                  <summary>${t("admin.webhook.body")}</summary>
                  <code class="mono">${d.body}</code>
                </details>
              </td>
              <td>
                <span class="tag ${TONES[d.state]}">${t(`admin.webhook.delivery.${d.state}`)}</span
                >${d.next_at && d.tries > 0 && html`<br /><span class="muted">${t("admin.webhook.next_try", { time: dateTime(d.next_at) })}</span>`}
              </td>
              <td class="num">${String(d.tries)}</td>
              <td>
                ${d.tried_at ? html`${d.status ?? "–"} · ${String(d.took_ms)} ms<br /><span class="mono muted">${d.answer}</span>` : "–"}
              </td>
              <td>
                ${d.state !== "waiting" && html`<button type="button" data-again="${String(d.id)}">${t("admin.webhook.again")}</button>`}
              </td>
            </tr>`,
        )}
      </tbody>
    </table>
  </div>`;
}
