// One marker in the drawer: where it is, what the walks found at it, what it was; and its editing, with a reason.
// When somebody else was faster, both are shown and the person decides.

import * as api from "../api.js";
import { dateTime, number } from "../format.js";
import { html, one, render } from "../html.js";
import { t } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { makeDrag } from "./drag.js";
import { historyList, residualFigures, residualTable } from "./record.js";

/** @typedef {import("./view.js").Marker} Marker */

/**
 * @param {import("../app.js").App} app
 * @param {{
 *   residualsOf: (name: string) => import("./view.js").MarkerResiduals | null, preview: (place: {name: string, e_m: number, n_m: number} | null) => void,
 *   changed: (name: string | null) => Promise<void>, closed: () => void,
 * }} on
 */
export function makeDetails(app, on) {
  const el = one("#drawer");
  /** @type {Marker | null} */
  let marker = null;
  /** @type {"none" | "show" | "edit" | "add"} */
  let mode = "none";
  /** What another person made of it while it was edited here. @type {Marker | null | undefined} */
  let theirs;

  const drag = makeDrag(app, ([e, n]) => {
    field("e_m").value = e.toFixed(2);
    field("n_m").value = n.toFixed(2);
    typed();
  });

  const field = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (one(`[name=${name}]`, el));
  /** @param {string} name @returns {number | null} */
  function value(name) {
    const text = field(name).value.trim().replace("−", "-");
    return text === "" ? null : Number(text);
  }

  function draw() {
    drag.stop();
    el.hidden = mode === "none";
    app.stage.map.invalidateSize({ animate: false });
    if (mode === "none") return render(el, html``);
    const name = marker?.name ?? "";
    const head = html`<header>
      <h2>${mode === "add" ? t("markers.add") : name}</h2>
      ${mode === "show" && app.may("survey") && html`<button type="button" class="main-action" data-do="edit">${t("markers.edit")}</button>`}<button
        type="button"
        class="quiet icon"
        data-do="close"
        aria-label="${t("close")}"
      >
        ✕
      </button>
    </header>`;
    if (mode === "show" && marker) {
      const found = on.residualsOf(name);
      return render(
        el,
        html`${head}
          <section>
            <dl class="facts">
              <dt>${t("axis.east_m")}</dt>
              <dd>${number(marker.e_m, 3)}</dd>
              <dt>${t("axis.north_m")}</dt>
              <dd>${number(marker.n_m, 3)}</dd>
              <dt>${t("axis.up_m")}</dt>
              <dd>${marker.u_m === null ? t("markers.no_height") : number(marker.u_m, 3)}</dd>
              <dt>${t("markers.updated")}</dt>
              <dd>${dateTime(marker.updated_at)}</dd>
            </dl>
          </section>
          <section data-testid="residuals">
            <h3>${t("markers.residuals")}</h3>
            ${residualFigures(found)}
            <div class="each"></div>
          </section>
          <section data-testid="history">
            <h3>${t("markers.history")}</h3>
            <div class="changes"><p class="muted">…</p></div>
          </section>`,
      );
    }
    return render(
      el,
      html`${head}
        <form data-draft data-testid="marker-form">
          <section>
            ${mode === "add" && html`<label class="field"><span>${t("markers.name")}</span><input name="name" required maxlength="100" autocomplete="off" spellcheck="false" /></label>`}
            <div class="three">
              ${[
                ["e_m", "axis.east_m", marker?.e_m],
                ["n_m", "axis.north_m", marker?.n_m],
                ["u_m", "axis.up_m", marker?.u_m],
              ].map(
                ([key, label, now]) =>
                  html`<label class="field"
                    ><span>${t(String(label))}</span
                    ><input
                      name="${key}"
                      inputmode="decimal"
                      autocomplete="off"
                      ${key !== "u_m" && html` required`}
                      pattern="\\s*[\\-−+]?[0-9]*[.]?[0-9]+\\s*"
                      value="${now ?? ""}"
                  /></label>`,
              )}
            </div>
            <div class="row">
              <button type="button" data-do="drag" aria-pressed="false" data-testid="drag">${t("markers.drag")}</button>
              <button type="button" data-do="undo" disabled data-testid="undo-drag">${t("markers.undo")}</button>
              <span class="muted moved" aria-live="polite"></span>
            </div>
          </section>
          <section>
            <label class="field"
              ><span>${t("markers.reason")}</span><input name="reason" required maxlength="500" autocomplete="off"
            /></label>
            <div class="answer" aria-live="polite"></div>
            <div class="row end">
              ${mode === "edit" && html`<button type="button" class="danger" data-do="remove">${t("markers.remove")}</button>`}<button
                type="button"
                data-do="cancel"
              >
                ${t("cancel")}</button
              ><button class="main-action" data-testid="save-marker">${t("markers.save")}</button>
            </div>
          </section>
        </form>`,
    );
  }

  async function fetchRecord() {
    if (mode !== "show" || !marker) return;
    const { name } = marker;
    // By the time of the answer another screen may have the drawer.
    const [changes, residuals] = [one(".changes", el), one(".each", el)];
    try {
      const [history, each, files] = await Promise.all([
        api.markerHistory(name),
        api.markerResiduals(name),
        api.markerImports(),
      ]);
      if (mode !== "show" || marker?.name !== name) return;
      render(changes, historyList(history, files));
      render(residuals, residualTable(each));
    } catch (error) {
      if (mode === "show" && marker?.name === name) render(changes, problemBox(error));
    }
  }

  /** Shows on the map and in words where the marker would stand. */
  function typed() {
    const [e, n] = [value("e_m"), value("n_m")];
    const known = e !== null && n !== null && Number.isFinite(e) && Number.isFinite(n);
    const name = marker?.name ?? (mode === "add" ? field("name").value : "");
    on.preview(known ? { name, e_m: e, n_m: n } : marker);
    const moved = known && marker ? Math.hypot(e - marker.e_m, n - marker.n_m) : null;
    render(
      one(".moved", el),
      html`${moved !== null && moved > 0 && t("markers.moved_by", { metres: number(moved, 2) })}`,
    );
    /** @type {HTMLButtonElement} */ (one("[data-do=undo]", el)).disabled = !drag.canUndo();
  }

  /** @param {(reason: string) => Promise<string | null>} change gives the name to be shown then */
  async function send(change) {
    const buttons = /** @type {NodeListOf<HTMLButtonElement>} */ (el.querySelectorAll("form button"));
    buttons.forEach((button) => (button.disabled = true));
    try {
      const name = await change(field("reason").value.trim());
      mode = "none";
      await on.changed(name);
    } catch (error) {
      buttons.forEach((button) => (button.disabled = false));
      const current =
        error instanceof api.Problem && ["marker_changed", "marker_exists"].includes(error.code)
          ? error.current
          : undefined;
      theirs = /** @type {Marker | null | undefined} */ (current);
      render(one(".answer", el), theirs ? conflict(theirs) : problemBox(error));
    }
  }

  /** @param {Marker} now */
  function conflict(now) {
    const row = (/** @type {string} */ label, /** @type {number | null} */ their, /** @type {number | null} */ mine) =>
      html`<tr>
        <th scope="row">${label}</th>
        <td class="num">${number(their, 3)}</td>
        <td class="num">${number(mine, 3)}</td>
      </tr>`;
    return html`<div class="problem" role="alert" data-testid="conflict">
      <b>${t("markers.conflict")}</b>
      <p>${t("markers.conflict_explain", { time: dateTime(now.updated_at) })}</p>
      <table>
        <thead>
          <tr>
            <th><span class="unseen">${t("markers.axis")}</span></th>
            <th class="num">${t("markers.theirs")}</th>
            <th class="num">${t("markers.mine")}</th>
          </tr>
        </thead>
        <tbody>
          ${row(t("axis.east_m"), now.e_m, value("e_m"))}${row(t("axis.north_m"), now.n_m, value("n_m"))}${row(t("axis.up_m"), now.u_m, value("u_m"))}
        </tbody>
      </table>
      <div class="row end">
        <button type="button" data-do="theirs">${t("markers.keep_theirs")}</button
        ><button type="button" data-do="mine">${t("markers.put_mine")}</button>
      </div>
    </div>`;
  }

  function save() {
    const name = marker?.name ?? field("name").value.trim();
    const place = { e_m: value("e_m"), n_m: value("n_m"), u_m: value("u_m") };
    return send(async (reason) => {
      if (mode === "add") return (await api.addMarker({ name, ...place, reason })).name;
      return (await api.putMarker(name, { ...place, reason, version: marker?.version })).name;
    });
  }

  const onClick = (/** @type {Event} */ event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("[data-do]");
    switch (button?.getAttribute("data-do")) {
      case "edit":
        mode = "edit";
        draw();
        return field("e_m").focus();
      case "close":
        mode = "none";
        draw();
        return on.closed();
      case "cancel":
        if (mode === "add") return on.closed();
        mode = "show";
        draw();
        on.preview(marker);
        return fetchRecord();
      case "drag":
        if (drag.active()) drag.stop();
        else drag.start([value("e_m") ?? 0, value("n_m") ?? 0]);
        return button?.setAttribute("aria-pressed", String(drag.active()));
      case "undo":
        return drag.undo();
      case "remove": {
        const reason = field("reason");
        if (!reason.reportValidity() || !marker) return;
        const { name, version } = marker;
        return send(async (why) => {
          await api.removeMarker(name, version, why);
          return null;
        });
      }
      case "theirs":
        marker = theirs ?? marker;
        mode = "none";
        return on.changed(marker?.name ?? null);
      case "mine":
        // Seen and decided: the change is sent again on top of what it is now.
        if (theirs) marker = theirs;
        mode = "edit";
        return save();
    }
  };
  const onSubmit = (/** @type {Event} */ event) => {
    event.preventDefault();
    save();
  };
  const onInput = (/** @type {Event} */ event) => {
    if (/** @type {HTMLInputElement} */ (event.target).name !== "reason") typed();
  };
  el.addEventListener("click", onClick);
  el.addEventListener("submit", onSubmit);
  el.addEventListener("input", onInput);

  return {
    /** Whether something is being edited, which a click elsewhere must not throw away. */
    busy: () => mode === "edit" || mode === "add",
    /** @param {Marker | null} which */
    show(which) {
      if (mode === "edit" && which?.name === marker?.name) return;
      marker = which;
      mode = which ? "show" : "none";
      draw();
      fetchRecord();
    },
    /** A new one, in the middle of the map. */
    add() {
      marker = null;
      mode = "add";
      draw();
      const middle = app.stage.map.getCenter();
      field("e_m").value = middle.lng.toFixed(2);
      field("n_m").value = middle.lat.toFixed(2);
      typed();
      field("name").focus();
    },
    /** @param {Marker[]} markers as they are now */
    refreshed(markers) {
      if (mode !== "show" || !marker) return;
      const now = markers.find((m) => m.name === marker?.name) ?? null;
      if (now?.version !== marker.version) this.show(now);
    },
    close() {
      drag.stop();
      el.removeEventListener("click", onClick);
      el.removeEventListener("submit", onSubmit);
      el.removeEventListener("input", onInput);
      render(el, html``);
      el.hidden = true;
    },
  };
}
