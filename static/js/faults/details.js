// One fault in the drawer: what and where, how sure that place was, the next steps, who goes, photos, history. Parts
// are shown anew one by one, so that a message of the feed does not take away what somebody is writing.

import * as api from "../api.js";
import { length } from "../format.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { inspectorsOf } from "../state/live.js";
import { problemBox } from "../ui/problem.js";
import { severitySymbol } from "../ui/symbols.js";
import { faultDetails, faultKind } from "./cards.js";
import { FAULT_KINDS } from "./form.js";
import { faultHistory, photoGrid } from "./record.js";
import { stepsFrom } from "./states.js";

/** @typedef {import("../state/live.js").Fault} Fault */
/**
 * @typedef {{
 *   inspector_id: string, name: string, session_id: string, distance_m: number, sigma_m: number, position_age_s: number, state: string, in_work: number, free: boolean,
 * }} Helper
 */

/** Helpers that are offered by name. */
const OFFERED = 4;

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} el
 * @param {{find: (id: string) => Fault | null, changed: (fault: Fault) => void}} on
 */
export function makeFaultDetails(app, el, on) {
  /** @type {string | null} */
  let shown = null;
  /** The version of which history and photos are shown. */
  let version = -1;
  /** @type {Helper[]} */
  let helpers = [];

  // What the server would refuse is not offered: who walks repairs, who dispatches sends people and verifies.
  const writes = app.may("walk");
  const sends = app.may("dispatch");
  const part = (/** @type {string} */ name) => one(`[data-part=${name}]`, el);
  const nameOf = (/** @type {string | null | undefined} */ id) => (id && app.live.inspectors.get(id)?.name) || "–";

  function update() {
    const fault = app.ui.fault ? on.find(app.ui.fault) : null;
    if (fault?.id !== shown) {
      shown = fault?.id ?? null;
      version = -1;
      helpers = [];
      el.hidden = fault === null;
      render(
        el,
        fault === null
          ? html``
          : html`<header><h2 data-part="title"></h2><button type="button" class="quiet icon" data-do="close" data-t-label="close">✕</button></header>
        <div data-testid="fault-details" data-of="${fault.id}">
          <section><div data-part="facts"></div></section>
          <section${!writes && html` hidden`}><h3 data-t="fault.next_step"></h3>
            <label class="field"><span data-t="fault.comment"></span><input name="comment" maxlength="2000" autocomplete="off"></label>
            <div class="actions" data-part="steps"></div><div class="answer" aria-live="polite"></div></section>
          <section${!sends && html` hidden`}><h3 data-t="fault.who_goes"></h3><div data-part="assign"></div></section>
          <section><h3 data-t="fault.photos"></h3><div data-part="photos"></div><label class="field"${!writes && html` hidden`}><span data-t="fault.add_photo"></span><input type="file" name="photo" accept="image/jpeg,image/png,image/webp" multiple data-testid="photo"></label></section>
          <section${!writes && html` hidden`}><details data-testid="edit-fault"><summary data-t="fault.edit"></summary><form data-draft data-part="edit"></form></details></section>
          <section data-testid="fault-history"><h3 data-t="fault.history"></h3><div data-part="history"></div></section>
        </div>`,
      );
      translate(el);
      app.stage.map.invalidateSize({ animate: false });
    }
    if (!fault) return;
    render(part("title"), html`${severitySymbol(fault.severity)} ${faultKind(fault.kind)}`);
    render(
      part("facts"),
      html`<p>
          <span class="tag state" data-state="${fault.state}" data-testid="fault-state"
            >${t(`fault.state.${fault.state}`)}</span
          >
        </p>
        ${faultDetails(fault, nameOf(fault.inspector_id))}`,
    );
    render(
      part("steps"),
      html`${stepsFrom(fault.state)
          .filter((step) => sends || step !== "verified")
          .map(
            (step, i) =>
              html`<button
                type="button"
                ${i === 0 && html` class="main-action"`}
                data-state="${step}"
                data-testid="step-${step}"
              >
                ${t(`fault.step.${fault.state}.${step}`)}
              </button>`,
          )}<button type="button" data-do="comment" data-testid="comment">${t("fault.only_comment")}</button>`,
    );
    assign(fault);
    if ((fault.version ?? 0) !== version) {
      version = fault.version ?? 0;
      edit(fault);
      fetchRecord(fault);
    }
  }

  /** @param {Fault} fault */
  function assign(fault) {
    render(
      part("assign"),
      html` <label class="field"
          ><span>${t("fault.assignee")}</span
          ><select name="assignee">
            <option value="">${t("fault.nobody")}</option>
            ${inspectorsOf(app.live).map((i) => html`<option value="${i.id}" ${i.id === fault.assignee_id && html` selected`}>${i.name}</option>`)}
          </select></label
        >
        ${
          helpers.length > 0 &&
          html`<p class="muted">${t("fault.nearest")}</p>
            <ul class="helpers">
              ${helpers.slice(0, OFFERED).map(
                (h) =>
                  html`<li>
                    <button
                      type="button"
                      data-assign="${h.inspector_id}"
                      data-testid="helper"
                      ${h.inspector_id === fault.assignee_id && html` disabled`}
                    >
                      <b>${h.name}</b>
                      <span class="muted"
                        >${length(h.distance_m)}${h.free ? "" : html` · ${t("fault.busy", { n: h.in_work })}`}</span
                      >
                    </button>
                  </li>`,
              )}
            </ul>`
        }`,
    );
  }

  /** @param {Fault} fault */
  function edit(fault) {
    const kinds = FAULT_KINDS.includes(fault.kind) ? FAULT_KINDS : [fault.kind, ...FAULT_KINDS];
    render(
      part("edit"),
      html` <label class="field"
          ><span>${t("fault.kind")}</span
          ><select name="kind">
            ${kinds.map((k) => html`<option value="${k}" ${k === fault.kind && html` selected`}>${faultKind(k)}</option>`)}
          </select></label
        >
        <fieldset>
          <legend>${t("fault.severity")}</legend>
          <div class="choices">
            ${["low", "medium", "high"].map((s) => html`<label><input type="radio" name="severity" value="${s}" ${s === fault.severity && html` checked`} />${t(`severity.${s}`)}</label>`)}
          </div>
        </fieldset>
        <label class="field"
          ><span>${t("fault.actuator")}</span
          ><input name="marker" value="${fault.marker ?? ""}" autocomplete="off" spellcheck="false"
        /></label>
        <label class="field"
          ><span>${t("fault.text")}</span><textarea name="text" maxlength="2000">${fault.text ?? ""}</textarea>
        </label>
        <div class="row end"><button class="main-action" data-testid="save-fault">${t("fault.save")}</button></div>`,
    );
  }

  /** @param {Fault} fault */
  async function fetchRecord(fault) {
    const record = part("history");
    try {
      const [history, photos, near] = await Promise.all([
        api.faultHistory(fault.id),
        api.faultPhotos(fault.id),
        api.nearestInspectors(fault.id),
      ]);
      // By the time of the answer another screen may have the drawer.
      if (shown !== fault.id || !record.isConnected) return;
      helpers = near;
      render(record, faultHistory(fault, history, nameOf));
      render(part("photos"), photoGrid(fault.id, photos, writes));
      assign(fault);
    } catch (error) {
      if (shown === fault.id) render(record, problemBox(error));
    }
  }

  /** @param {(fault: Fault) => Promise<Fault>} work */
  async function run(work) {
    const fault = shown ? on.find(shown) : null;
    if (!fault) return;
    const answer = one(".answer", el);
    try {
      const now = await work(fault);
      render(answer, html``);
      on.changed(now);
    } catch (error) {
      render(answer, problemBox(error));
      // Somebody else was faster: what it is now is shown, and what was written here stays.
      if (error instanceof api.Problem && error.current) on.changed(/** @type {Fault} */ (error.current));
    }
  }

  /** @param {Record<string, unknown>} change */
  const patch = (change) =>
    run(async (fault) => {
      const comment = /** @type {HTMLInputElement} */ (one("[name=comment]", el));
      const now = await api.changeFault(fault.id, {
        ...change,
        version: fault.version,
        ...(comment.value.trim() ? { comment: comment.value } : {}),
      });
      comment.value = "";
      return now;
    });

  const onClick = (/** @type {Event} */ event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("button");
    if (!button) return;
    const { state, assign: inspector, do: what, removePhoto } = button.dataset;
    if (state) return patch({ state });
    if (inspector) return patch({ assignee_id: inspector });
    if (what === "comment") return patch({});
    if (removePhoto)
      return run(async (fault) => {
        await api.removePhoto(fault.id, removePhoto);
        return api.fault(fault.id);
      });
    if (what === "close") {
      app.ui.fault = null;
      app.changed("choice");
    }
  };
  const onChange = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    if (input.name === "assignee") return patch({ assignee_id: input.value || null });
    if (input.name !== "photo") return;
    const files = [...(input.files ?? [])];
    return run(async (fault) => {
      for (const file of files) await api.addPhoto(fault.id, file);
      input.value = "";
      return api.fault(fault.id);
    });
  };
  const onSubmit = (/** @type {Event} */ event) => {
    event.preventDefault();
    const data = new FormData(/** @type {HTMLFormElement} */ (event.target));
    const marker = String(data.get("marker") ?? "").trim();
    return patch({
      kind: data.get("kind"),
      severity: data.get("severity"),
      text: data.get("text"),
      marker: marker || null,
    });
  };
  el.addEventListener("click", onClick);
  el.addEventListener("change", onChange);
  el.addEventListener("submit", onSubmit);

  return {
    update,
    close() {
      el.removeEventListener("click", onClick);
      el.removeEventListener("change", onChange);
      el.removeEventListener("submit", onSubmit);
      render(el, html``);
      el.hidden = true;
    },
  };
}
