// All faults, beside the map: open ones to be closed, closed ones to look up.

import { closeFault, faults as fetchFaults } from "../api.js";
import { dateTime } from "../format.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { problemBox } from "../ui/problem.js";
import { severitySign } from "../ui/signs.js";
import { faultCards, faultDetails, faultKind, placeOf } from "./cards.js";

/** @type {import("../ui/router.js").MakeView} */
export function faultsView(app, side) {
  render(side, html`
    <div class="side-head"><h1 data-t="nav.faults"></h1><p class="summary"></p></div>
    <div class="open" data-testid="open-faults"></div>
    <div class="selected"></div>
    <div class="list-title"><h2 data-t="fault.closed"></h2></div>
    <div class="closed"></div>`);
  translate(side);
  /** @type {import("../state/live.js").Fault[]} */
  let closed = [];
  let gone = false;

  async function fetchClosed() {
    try {
      const all = await fetchFaults();
      if (gone) return;
      closed = all.filter((f) => f.state !== "open").sort((a, b) => b.reported_at.localeCompare(a.reported_at));
      show();
    } catch (error) {
      if (!gone) render(one(".closed", side), problemBox(error));
    }
  }

  const onClick = async (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const id = target.closest("[data-fault]")?.getAttribute("data-fault");
    const close = target.closest("[data-close-fault]");
    if (close instanceof HTMLButtonElement && app.ui.fault) {
      close.disabled = true;
      try {
        const fault = await closeFault(app.ui.fault);
        app.live.faults.set(fault.id, fault);
        app.ui.fault = null;
        app.changed("fault", "choice");
        await fetchClosed();
      } catch (error) {
        render(one(".answer", side), problemBox(error));
        close.disabled = false;
      }
    } else if (id) {
      app.ui.fault = id === app.ui.fault ? null : id;
      // The map stays at the fault, wherever the inspector goes meanwhile.
      app.ui.follow = false;
      const fault = app.live.faults.get(id);
      if (fault?.position_m) app.stage.goTo([fault.position_m[0], fault.position_m[1]], 1.5);
      app.changed("choice");
    }
  };
  side.addEventListener("click", onClick);

  function show() {
    const open = app.layers.openFaults();
    render(one(".summary", side), html`<span><b>${open.length}</b> ${t("live.faults_open")}</span>`);
    render(one(".open", side), faultCards(app, open));
    const selected = open.find((f) => f.id === app.ui.fault);
    render(one(".selected", side), selected
      ? html`<div class="session" data-testid="fault-details"><h2>${faultKind(selected.kind)}</h2>${faultDetails(selected, nameOf(selected))}
          <div class="answer"></div><div class="row end"><button type="button" class="main-action" data-close-fault data-testid="close-fault">${t("fault.close")}</button></div></div>`
      : html`<p class="empty">${open.length > 0 && t("fault.choose")}</p>`);
    render(one(".closed", side), closed.length === 0 ? html`<p class="empty">${t("fault.none_closed")}</p>` : html`${closed.map(
      (f) => html`<div class="card"><span class="line">${severitySign(f.severity)}<span class="grow">${faultKind(f.kind)}</span><span class="tag">${placeOf(f)}</span></span>
        <span class="sub">${nameOf(f)} · ${dateTime(f.reported_at)}${f.closed_at && html` → ${dateTime(f.closed_at)}`}</span></div>`,
    )}`);
  }

  /** @param {import("../state/live.js").Fault} fault */
  const nameOf = (fault) => (fault.inspector_id && app.live.inspectors.get(fault.inspector_id)?.name) || "–";

  fetchClosed();
  return {
    update(changed) {
      if (changed.has("all") || changed.has("fault") || changed.has("choice")) show();
      if (changed.has("fault")) fetchClosed();
    },
    close() {
      gone = true;
      side.removeEventListener("click", onClick);
    },
  };
}
