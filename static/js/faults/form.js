// Reporting a fault where an inspector stands, or for somebody who has called. The actuator is chosen by the person or left open; it is
// never taken silently from the position, because they stand about as far apart as a position may be off.

import { addPhoto, reportFault } from "../api.js";
import { length, percent } from "../format.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { inspectorsOf } from "../state/live.js";
import { makeDialog } from "../ui/dialog.js";
import { problemBox } from "../ui/problem.js";
import { candidateTable, faultKind } from "./cards.js";
import { stands } from "./states.js";

/** Demo classes; a kind that is not here is shown as it was sent. */
export const FAULT_KINDS = [
  "hydraulic_leak",
  "motor_over_temperature",
  "communication_loss",
  "stroke_limit",
  "tie_down_cable_wear",
  "anchor_bolt",
  "panel_damage",
  "drainage",
  "other",
];
const SEVERITIES = ["low", "medium", "high"];

/** @param {import("../app.js").App} app */
export function makeFaultForm(app) {
  const dialog = makeDialog("fault");
  /** @type {import("../state/attention.js").Person | null} */
  let person = null;

  const markerOf = (/** @type {FormData} */ data) =>
    String(data.get("marker_typed") ?? "")
      .trim()
      .toUpperCase() || String(data.get("marker") ?? "");

  // The same thing that two people see is one fault.
  dialog.el.addEventListener("input", (event) => {
    const form = /** @type {HTMLElement} */ (event.target).closest("form");
    if (!form) return;
    const data = new FormData(form);
    const [kind, marker] = [data.get("kind"), markerOf(data)];
    const same = [...app.live.faults.values()].find(
      (fault) => stands(fault) && fault.kind === kind && fault.marker === marker,
    );
    render(
      one(".same", form),
      same && marker
        ? html`<p class="warn">
            ${t("fault.same", { kind: faultKind(same.kind), marker })}
            <a href="#/faults?fault=${same.id}" data-close>${t("fault.open_same")}</a>
          </p>`
        : html``,
    );
  });

  dialog.el.addEventListener("submit", async (event) => {
    event.preventDefault();
    const form = /** @type {HTMLFormElement} */ (event.target);
    const data = new FormData(form);
    const button = /** @type {HTMLButtonElement} */ (one("button.main-action", form));
    button.disabled = true;
    try {
      const marker = markerOf(data);
      const fault = await reportFault({
        ...(person?.session
          ? { session_id: person.session.id }
          : { inspector_id: person?.inspector.id ?? data.get("inspector_id") }),
        kind: data.get("kind"),
        severity: data.get("severity"),
        ...(data.get("text") ? { text: data.get("text") } : {}),
        ...(marker ? { marker } : {}),
      });
      app.live.faults.set(fault.id, fault);
      app.changed("fault");
      // The report stands; a photo that is refused is told beside it.
      /** @type {unknown} */
      let refused = null;
      for (const photo of data.getAll("photo")) {
        if (photo instanceof File && photo.size > 0)
          await addPhoto(fault.id, photo).catch((error) => (refused = error));
      }
      dialog.open(
        html` <h2 id="fault-title">${t("fault.done")}</h2>
          <p class="lead">
            ${t(fault.marker ? "fault.done_keyed" : "fault.done_ranked", { marker: fault.marker ?? "" })}
          </p>
          ${refused !== null && problemBox(refused)} ${candidateTable(fault)}
          <div class="row end">
            <button type="button" class="main-action" data-close autofocus>${t("close")}</button>
          </div>`,
      );
    } catch (error) {
      render(one(".answer", form), problemBox(error));
      button.disabled = false;
    }
  });

  return {
    /**
     * @param {import("../state/attention.js").Person | null} who null: the reporter is chosen in the form
     * @param {ReturnType<typeof import("../geometry.js").rankPlaces<{name: string, e_m: number, n_m: number}>>} candidates
     */
    show(who, candidates) {
      person = who;
      dialog.open(
        html` <form data-for="${who?.inspector.id ?? ""}" data-at="${Date.now()}">
          <h2 id="fault-title">${t("fault.report")}${who && ` · ${who.inspector.name}`}</h2>
          <p class="lead">${t("fault.explain")}</p>
          ${
            !who &&
            html`<label class="field"
              ><span>${t("fault.by")}</span
              ><select name="inspector_id" required>
                <option value=""></option>
                ${inspectorsOf(app.live).map((i) => html`<option value="${i.id}">${i.name}</option>`)}
              </select></label
            >`
          }
          <label class="field"
            ><span>${t("fault.kind")}</span
            ><select name="kind" autofocus>
              ${FAULT_KINDS.map((k) => html`<option value="${k}">${t(`fault.kind.${k}`)}</option>`)}
            </select></label
          >
          <fieldset>
            <legend>${t("fault.severity")}</legend>
            <div class="choices">
              ${SEVERITIES.map((s) => html`<label><input type="radio" name="severity" value="${s}" ${s === "medium" && html` checked`} />${t(`severity.${s}`)}</label>`)}
            </div>
          </fieldset>
          <fieldset ${!who && "hidden"}>
            <legend>${t("fault.actuator")}</legend>
            <div class="choices">
              <label><input type="radio" name="marker" value="" checked />${t("fault.not_sure")}</label>
              ${candidates.map((c) => html`<label><input type="radio" name="marker" value="${c.place.name}" /><b>${c.place.name}</b> <small class="muted">${percent(c.probability)} · ${length(c.distance_m)}</small></label>`)}
            </div>
          </fieldset>
          <label class="field"
            ><span>${t("fault.typed")}</span><input name="marker_typed" autocomplete="off" spellcheck="false"
          /></label>
          <label class="field"><span>${t("fault.text")}</span><textarea name="text" maxlength="2000"></textarea></label>
          <label class="field"
            ><span>${t("fault.add_photo")}</span
            ><input type="file" name="photo" accept="image/jpeg,image/png,image/webp" multiple
          /></label>
          <div class="same" aria-live="polite"></div>
          <div class="answer" aria-live="polite"></div>
          <div class="row end">
            <button type="button" data-close>${t("cancel")}</button
            ><button class="main-action">${t("fault.send")}</button>
          </div>
        </form>`,
      );
    },
    remove: () => dialog.el.remove(),
  };
}
