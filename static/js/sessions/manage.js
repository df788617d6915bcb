// What people correct of a walk: its title, who walked, where it began, whether it counts; and the same computed again.

import * as api from "../api.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { systemNamed } from "../systems/index.js";
import { problemBox } from "../ui/problem.js";

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} box
 * @param {any} row the session
 * @param {() => void} onChange
 */
export function showManage(app, box, row, onChange) {
  if (!app.writesFor(row.inspector_id)) return;
  const { carrierKind } = systemNamed(row.system);
  const carriers = [...app.live.inspectors.values()].filter(
    ({ id, kind = "person" }) => app.writesFor(id) && (kind === "person" || kind === carrierKind),
  );
  const { marker = null, position_m = [0, 0, 0], known = false } = row.start ?? {};
  const fresh = render(
    box,
    html`<h2>${t("sessions.manage.title")}</h2>
      <form data-draft data-testid="manage" class="manage">
        <label class="field"
          ><span>${t("sessions.manage.name")}</span><input name="title" maxlength="200" value="${row.title}"
        /></label>
        <label class="field"
          ><span>${t("sessions.manage.inspector")}</span
          ><select name="inspector_id">
            ${carriers.map((i) => html`<option value="${i.id}" ${i.id === row.inspector_id && "selected"}>${i.name}</option>`)}
          </select></label
        >
        <label class="field"
          ><span>${t("sessions.manage.start")}</span
          ><input
            name="start"
            autocomplete="off"
            autocapitalize="characters"
            spellcheck="false"
            value="${marker ?? ""}"
            placeholder="${known ? position_m.map((/** @type {number} */ v) => v.toFixed(1)).join(", ") : t("sessions.manage.start_unknown")}"
        /></label>
        <p class="muted">${t("sessions.manage.start_hint")}</p>
        <label
          ><input type="checkbox" name="excluded" ${row.excluded && "checked"} />${t("sessions.manage.excluded")}</label
        >
        <p class="row">
          <button class="main-action">${t("sessions.manage.save")}</button>
          ${row.samples > 0 && row.state !== "live" && html`<button type="button" data-again>${t("sessions.manage.again")}</button>`}
        </p>
      </form>
      <div class="answer" aria-live="polite"></div>`,
  );
  if (!fresh) return;
  const form = /** @type {HTMLFormElement} */ (one("form", box));
  const attempt = async (/** @type {() => Promise<unknown>} */ ask, /** @type {string} */ done) => {
    try {
      await ask();
      render(one(".answer", box), html`<p class="good">${t(done)}</p>`);
      onChange();
    } catch (error) {
      if (box.isConnected) render(one(".answer", box), problemBox(error));
    }
  };
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const data = new FormData(form);
    const text = (/** @type {string} */ name) => String(data.get(name) ?? "").trim();
    const start = text("start");
    const change = {
      title: text("title"),
      excluded: data.has("excluded"),
      ...(text("inspector_id") !== row.inspector_id ? { inspector_id: text("inspector_id") } : {}),
      ...(start === (marker ?? "")
        ? {}
        : { start: start === "" ? null : { marker: app.grid.named(start)?.name ?? start } }),
    };
    attempt(() => api.changeSession(row.id, change), "sessions.manage.saved");
  });
  form.querySelector("[data-again]")?.addEventListener("click", () => {
    attempt(() => api.processSession(row.id), "sessions.manage.queued");
  });
}
