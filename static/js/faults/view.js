// All faults, list and map: found by state, severity, who sees to them and words; one at a time in the drawer.

import { faults as fetchFaults } from "../api.js";
import { html, one, render } from "../html.js";
import { t, translate } from "../i18n.js";
import { inspectorsOf } from "../state/live.js";
import { problemBox } from "../ui/problem.js";
import { faultCards, faultKind, placeOf } from "./cards.js";
import { makeFaultDetails } from "./details.js";
import { makeFaultForm } from "./form.js";
import { passes, stands, STATES } from "./states.js";

/** The columns of the exported list. */
const EXPORTED = /** @type {const} */ ([
  "id",
  "reported_at",
  "kind",
  "severity",
  "state",
  "inspector",
  "assignee",
  "marker",
  "candidate",
  "probability",
  "east_m",
  "north_m",
  "sigma_m",
  "text",
  "session_id",
]);
/** More cards than this nobody reads; the filters narrow them. */
const MOST_CARDS = 200;

/** @type {import("../ui/router.js").MakeView} */
export function faultsView(app, side) {
  render(
    side,
    html` <div class="side-head">
        <h1 data-t="nav.faults"></h1>
        <p class="summary"></p>
        <input type="search" data-t-hint="fault.search" data-t-label="fault.search" autocomplete="off" />
        <div class="three filters-3">
          <select data-filter="state" data-t-label="fault.state"></select
          ><select data-filter="severity" data-t-label="fault.severity"></select
          ><select data-filter="assignee" data-t-label="fault.assignee"></select>
        </div>
      </div>
      <p class="row">
        ${app.may("walk") && app.may("walk_for_others") && !app.me.inspector_id && html`<button type="button" data-report data-testid="report-call" data-t="fault.report"></button>`}<button
          type="button"
          data-export
          data-testid="export-faults"
          data-t="list.export"
        ></button>
      </p>
      <div class="answer"></div>
      <div class="cards" data-testid="faults"></div>`,
  );
  translate(side);
  let gone = false;
  /** Those that are done with; the others come by the feed. @type {Map<string, import("../state/live.js").Fault>} */
  const known = new Map();
  const filter = { state: "standing", severity: "", assignee: "", text: "" };
  const select = (/** @type {string} */ name) => /** @type {HTMLSelectElement} */ (one(`[data-filter=${name}]`, side));
  const option = (/** @type {string} */ value, /** @type {string} */ words, /** @type {string} */ chosen) =>
    html`<option value="${value}" ${value === chosen && html` selected`}>${words}</option>`;
  render(
    select("state"),
    html`${option("standing", t("fault.standing"), "standing")}${option("to_be_placed", t("fault.to_be_placed"), "standing")}${STATES.map((s) => option(s, t(`fault.state.${s}`), ""))}${option("", t("fault.all_states"), "-")}`,
  );
  render(
    select("severity"),
    html`${option("", t("fault.all_severities"), "-")}${["high", "medium", "low"].map((s) => option(s, t(`severity.${s}`), ""))}`,
  );

  const details = makeFaultDetails(app, one("#drawer"), {
    find: (id) => app.live.faults.get(id) ?? known.get(id) ?? null,
    changed(fault) {
      known.set(fault.id, fault);
      app.live.faults.set(fault.id, fault);
      app.changed("fault", "choice");
    },
  });

  /** For those who call. @type {ReturnType<typeof makeFaultForm> | null} */
  let form = null;

  async function fetchAll() {
    try {
      for (const fault of await fetchFaults()) known.set(fault.id, fault);
      if (!gone) {
        render(one(".answer", side), html``);
        app.changed("fault");
      }
    } catch (error) {
      if (!gone) render(one(".answer", side), problemBox(error));
    }
  }

  const all = () => [...new Map([...known, ...app.live.faults]).values()];
  const nameOf = (/** @type {string | null | undefined} */ id) => (id && app.live.inspectors.get(id)?.name) || "";

  function show() {
    render(
      select("assignee"),
      html`${option("", t("fault.anybody"), "-")}${option("nobody", t("fault.nobody"), filter.assignee)}${inspectorsOf(app.live).map((i) => option(i.id, i.name, filter.assignee))}`,
    );
    const faults = all();
    const shown = faults.filter((fault) =>
      passes(
        fault,
        filter,
        [faultKind(fault.kind), fault.text, placeOf(fault), nameOf(fault.inspector_id), nameOf(fault.assignee_id)].join(
          " ",
        ),
      ),
    );
    app.shownFaults = shown;
    const count = (/** @type {string} */ state) => faults.filter((fault) => fault.state === state).length;
    render(
      one(".summary", side),
      html`<span><b>${faults.filter(stands).length}</b> ${t("live.faults_open")}</span
        >${STATES.slice(0, 4).map((s) => count(s) > 0 && html`<span><b>${count(s)}</b> ${t(`fault.state.${s}`)}</span>`)}`,
    );
    render(
      one(".cards", side),
      shown.length === 0
        ? html`<p class="empty">${t("fault.none_found")}</p>`
        : faultCards(app, shown.slice(0, MOST_CARDS)),
    );
  }

  async function exportShown() {
    const { csv, download } = await import("../ui/csv.js");
    const rows = (app.shownFaults ?? []).map((fault) => ({
      ...fault,
      inspector: nameOf(fault.inspector_id),
      assignee: nameOf(fault.assignee_id),
      east_m: fault.position_m?.[0],
      north_m: fault.position_m?.[1],
      sigma_m: fault.sigma_m && Math.max(fault.sigma_m[0], fault.sigma_m[1]),
      candidate: fault.candidates?.[0]?.marker,
      probability: fault.candidates?.[0]?.probability,
    }));
    download("faults.csv", csv(EXPORTED, rows));
  }

  const onClick = (/** @type {Event} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    if (target.closest("[data-export]")) return void exportShown();
    if (target.closest("[data-report]")) {
      form ??= makeFaultForm(app);
      return form.show(null, []);
    }
    const id = target.closest("[data-fault]")?.getAttribute("data-fault");
    if (!id) return;
    app.ui.fault = id === app.ui.fault ? null : id;
    // The map stays at the fault, wherever the inspector goes meanwhile.
    app.ui.follow = false;
    const fault = app.live.faults.get(id) ?? known.get(id);
    if (fault?.position_m) app.stage.goTo([fault.position_m[0], fault.position_m[1]], 1.5);
    app.changed("choice");
  };
  const onFilter = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    const name = input.dataset.filter ?? "text";
    Object.assign(filter, { [name]: input.value });
    show();
    app.changed("choice");
  };
  side.addEventListener("click", onClick);
  side.addEventListener("input", onFilter);
  fetchAll();

  return {
    update(changed) {
      if (["all", "fault", "choice", "session"].some((topic) => changed.has(/** @type {any} */ (topic)))) show();
      if (["all", "fault", "choice"].some((topic) => changed.has(/** @type {any} */ (topic)))) details.update();
    },
    close() {
      gone = true;
      app.shownFaults = null;
      details.close();
      form?.remove();
      side.removeEventListener("click", onClick);
      side.removeEventListener("input", onFilter);
    },
  };
}
