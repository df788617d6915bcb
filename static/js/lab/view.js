// The laboratory: other parameters, walks worked out with them, and whether that helps on every walk.

import * as api from "../api.js";
import { dateTime, length, percent } from "../format.js";
import { html, one, render, setText } from "../html.js";
import { t, tOr } from "../i18n.js";
import { systemNamed } from "../systems/index.js";
import { problemBox } from "../ui/problem.js";
import { comparisonTable } from "./comparison.js";
import { makeParameterTable } from "./parameters.js";
import { siteCard } from "./site.js";

/**
 * @typedef {import("./parameters.js").ParameterSet} ParameterSet
 * @typedef {{id: string, session_id: string, name: string, parameters: Record<string, number>, aids: string[] | null, solution: string, job_id: string, state: string, error?: string}} LabRun
 */

/** @type {import("../ui/router.js").MakeView} */
export function labView(app, side) {
  const mayTurn = app.may("engineer");
  render(
    side,
    html`<div class="page lab" data-testid="lab">
      <h1>${t("nav.lab")}</h1>
      <p class="lead">${t("lab.lead")}</p>
      <div class="answer" aria-live="polite"></div>
      <section class="block sets">
        <div class="which"></div>
        ${mayTurn && html`<form class="row new-set"><input name="name" class="grow" maxlength="80" required placeholder="${t("lab.set_name")}" aria-label="${t("lab.set_name")}" /><input name="about" class="grow" maxlength="1000" placeholder="${t("lab.set_about")}" aria-label="${t("lab.set_about")}" /><button>${t("lab.save_as")}</button></form>`}
      </section>
      <section class="block site" data-testid="site-parameters"></section>
      <section class="block">
        <h2>${t("lab.parameters")}</h2>
        <div class="table"></div>
      </section>
      <section class="block walks">
        <h2>${t("lab.walks")}</h2>
        <div class="row">
          <input
            type="search"
            class="grow"
            name="filter"
            placeholder="${t("lab.filter")}"
            aria-label="${t("lab.filter")}"
          /><button type="button" data-all>${t("lab.choose_all")}</button
          ><button type="button" data-none>${t("lab.choose_none")}</button>
        </div>
        <div class="scroll list" tabindex="0" role="region" aria-label="${t("lab.walks")}"></div>
        ${mayTurn && html`<div class="row end"><span class="grow muted chosen"></span><button type="button" class="main-action" data-start>${t("lab.start")}</button></div>`}
        <div class="under-way" aria-live="polite" data-testid="under-way"></div>
      </section>
      <section class="block results">
        <h2>${t("lab.comparison")}</h2>
        <div class="room"><p class="muted">${t("lab.nothing_chosen")}</p></div>
      </section>
    </div>`,
  );
  const answer = one(".answer", side);
  /** @type {Map<string, number>} what differs from the default */
  const values = new Map();
  /** @type {Set<string>} */
  const chosen = new Set(
    new URLSearchParams(location.hash.split("?")[1] ?? "").get("walks")?.split(",").filter(Boolean) ?? [],
  );
  /** @type {ParameterSet[]} */
  let sets = [];
  /** @type {ParameterSet | null} */
  let set = null;
  /** @type {import("./site.js").SiteParameters | null} */
  let site = null;
  /** @type {any[]} */
  let walks = [];
  /** @type {LabRun[]} those that have not ended */
  let underWay = [];
  /** @type {ReturnType<typeof makeParameterTable> | null} */
  let table = null;
  let compared = 0;
  let gone = false;

  /**
   * Does something, and says why it could not.
   * @param {() => Promise<unknown>} run
   */
  async function attempt(run) {
    render(answer, html``);
    try {
      await run();
    } catch (error) {
      if (!gone) render(answer, problemBox(error));
    }
  }

  // Sets of parameters.

  const given = () => Object.fromEntries(values);
  const isSet = () => set !== null && JSON.stringify(sorted(set.parameters)) === JSON.stringify(sorted(given()));

  function showSets() {
    const kept = set;
    render(
      one(".sets .which", side),
      html`<h2>${t("lab.sets")}</h2>
        <div class="row">
          <select name="set" class="grow" aria-label="${t("lab.sets")}">
            <option value="">${t("lab.default_set")}</option>
            ${sets.map((s) => html`<option value="${s.id}" ${s.id === kept?.id && "selected"}>${s.name}</option>`)}
          </select>
          ${mayTurn && html`<button type="button" data-save ${(kept === null || isSet()) && "disabled"}>${t("lab.save")}</button><button type="button" data-remove-set ${kept === null && "disabled"}>${t("lab.remove")}</button>`}
        </div>
        ${kept?.about && html`<p class="muted">${kept.about}</p>`}
        <p class="state">
          ${values.size === 0 ? t("lab.all_default") : t("lab.changed", { n: values.size })}${kept && !isSet() && html` · <span class="warn">${t("lab.not_saved")}</span>`}
        </p>`,
    );
    if (site) render(one(".site", side), siteCard(site, sets, kept !== null && isSet() ? kept : null, mayTurn));
  }

  /** @param {ParameterSet | null} other */
  function take(other) {
    set = other;
    values.clear();
    for (const [key, value] of Object.entries(other?.parameters ?? {})) values.set(key, value);
    table?.show();
    showSets();
  }

  async function loadSets() {
    [sets, site] = await Promise.all([api.parameterSets(), api.siteParameters()]);
    set = sets.find((s) => s.id === set?.id) ?? null;
    if (!gone) showSets();
  }

  // Walks.

  const nameOf = (/** @type {any} */ walk) => walk.title || app.live.inspectors.get(walk.inspector_id)?.name || "–";

  function showWalks() {
    const wanted = /** @type {HTMLInputElement} */ (one("[name=filter]", side)).value.trim().toLowerCase();
    const shown = walks.filter((walk) =>
      `${walk.title} ${app.live.inspectors.get(walk.inspector_id)?.name ?? ""} ${walk.started_at}`
        .toLowerCase()
        .includes(wanted),
    );
    render(
      one(".walks .list", side),
      shown.length === 0
        ? html`<p class="muted">${t("lab.no_walks")}</p>`
        : html`<table data-testid="lab-walks">
            <tbody>
              ${shown.map(
                (walk) =>
                  html`<tr>
                    <td>
                      <label
                        ><input
                          type="checkbox"
                          name="walk"
                          value="${walk.id}"
                          ${chosen.has(walk.id) && "checked"}
                        />${nameOf(walk)}</label
                      >
                    </td>
                    <td class="muted">${app.live.inspectors.get(walk.inspector_id)?.name ?? ""}</td>
                    <td class="muted">${dateTime(walk.started_at)}</td>
                    <td class="num">${length(walk.distance_m)}</td>
                  </tr>`,
              )}
            </tbody>
          </table>`,
    );
    showChosen();
  }

  function showChosen() {
    if (mayTurn) {
      setText(one(".chosen", side), t("lab.chosen", { n: chosen.size }));
      /** @type {HTMLButtonElement} */ (one("[data-start]", side)).disabled =
        chosen.size === 0 || (table?.isWrong() ?? true);
    }
    history.replaceState(null, "", `#/lab${chosen.size > 0 ? `?walks=${[...chosen].join(",")}` : ""}`);
    compare();
  }

  // Runs that are on their way.

  async function look() {
    const runs = /** @type {LabRun[]} */ (await api.labRuns());
    if (gone) return;
    const ended = underWay.filter((was) => !runs.some((run) => run.id === was.id && isUnderWay(run)));
    const failed = runs.filter((run) => run.state === "failed" && ended.some((was) => was.id === run.id));
    underWay = runs.filter(isUnderWay);
    showUnderWay();
    if (failed.length > 0)
      render(
        answer,
        html`${failed.map(
          (run) =>
            html`<div class="problem" role="alert">
              <b>${t("lab.failed", { run: run.name, walk: walkName(run.session_id) })}</b>
              <p>${run.error ?? ""}</p>
            </div>`,
        )}`,
      );
    if (ended.length > 0) compare();
  }

  const walkName = (/** @type {string} */ id) => nameOf(walks.find((walk) => walk.id === id) ?? {});

  function showUnderWay() {
    render(
      one(".under-way", side),
      underWay.length === 0
        ? html``
        : html`<h3>${t("lab.under_way", { n: underWay.length })}</h3>
            ${underWay.map((run) => {
              const job = app.live.jobs.get(run.job_id);
              const words = job?.state === "running" ? tOr(`job.stage.${job.stage}`, job.stage ?? "") : t("job.queued");
              return html`<div class="row" data-run="${run.id}">
                <span class="grow">${run.name} · ${walkName(run.session_id)}</span><span class="muted">${words}</span
                ><progress max="1" value="${String(job?.progress ?? 0)}" aria-label="${run.name}">
                  ${percent(job?.progress ?? 0)}
                </progress>
                ${mayTurn && html`<button type="button" data-cancel="${run.id}">${t("cancel")}</button>`}
              </div>`;
            })}`,
    );
  }

  // What they came to.

  async function compare() {
    const room = one(".results .room", side);
    const asked = (compared += 1);
    if (chosen.size === 0) {
      render(room, html`<p class="muted">${t("lab.nothing_chosen")}</p>`);
      return;
    }
    try {
      const found = await api.labComparison([...chosen]);
      if (gone || asked !== compared) return;
      render(
        room,
        html`<p class="row end">
            <a class="button" href="${api.labComparisonFile([...chosen])}" download>${t("lab.csv")}</a>
          </p>
          ${comparisonTable(found, mayTurn)}`,
      );
    } catch (error) {
      if (!gone && asked === compared) render(room, problemBox(error));
    }
  }

  async function start() {
    const runs = await api.startLabRuns({
      session_ids: [...chosen],
      parameters: given(),
      ...(set && isSet()
        ? { parameter_set_id: set.id }
        : values.size > 0
          ? { name: set ? `${set.name} *` : t("lab.unnamed") }
          : {}),
    });
    underWay = [...underWay, ...runs];
    showUnderWay();
    await look();
  }

  side.addEventListener("change", onChange);
  side.addEventListener("input", onInput);
  side.addEventListener("click", onClick);
  side.addEventListener("submit", onSubmit);

  /** @param {Event} event */
  function onChange(event) {
    const field = /** @type {HTMLInputElement} */ (event.target);
    if (field.name === "set") take(sets.find((s) => s.id === field.value) ?? null);
    if (field.name === "walk") {
      if (field.checked) chosen.add(field.value);
      else chosen.delete(field.value);
      showChosen();
    }
  }

  /** @param {Event} event */
  function onInput(event) {
    if (/** @type {HTMLInputElement} */ (event.target).name === "filter") showWalks();
  }

  /** @param {Event} event */
  function onClick(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    const read = (/** @type {string} */ name) => target.closest(`[data-${name}]`)?.getAttribute(`data-${name}`) ?? null;
    if (read("start") !== null) attempt(start);
    if (read("all") !== null || read("none") !== null) {
      for (const box of side.querySelectorAll("[name=walk]")) {
        const { value } = /** @type {HTMLInputElement} */ (box);
        if (read("all") !== null) chosen.add(value);
        else chosen.delete(value);
      }
      showWalks();
    }
    const [cancel, removed] = [read("cancel"), read("remove-run")];
    if (cancel) attempt(() => api.cancelLabRun(cancel).then(look));
    if (removed && confirm(t("lab.remove_sure"))) attempt(() => api.removeLabRun(removed).then(compare));
    const kept = set;
    if (kept && read("save") !== null)
      attempt(() =>
        api
          .changeParameterSet(kept.id, {
            name: kept.name,
            about: kept.about,
            parameters: given(),
            version: kept.version,
          })
          .then(loadSets),
      );
    if (kept && read("make-site") !== null && confirm(t("lab.make_site_sure", { name: kept.name })))
      attempt(() => api.chooseSiteParameters({ parameter_set_id: kept.id, version: kept.version }).finally(loadSets));
    if (read("site-default") !== null && confirm(t("lab.site_default_sure")))
      attempt(() => api.chooseSiteParameters({ parameter_set_id: null }).then(loadSets));
    if (kept && read("remove-set") !== null && confirm(t("lab.remove_set_sure", { name: kept.name }))) {
      attempt(async () => {
        await api.removeParameterSet(kept.id);
        set = null;
        await loadSets();
      });
    }
  }

  /** @param {SubmitEvent} event */
  function onSubmit(event) {
    event.preventDefault();
    const form = /** @type {HTMLFormElement} */ (event.target);
    const data = new FormData(form);
    attempt(async () => {
      set = await api.addParameterSet({
        name: String(data.get("name")),
        about: String(data.get("about")),
        parameters: given(),
      });
      form.reset();
      await loadSets();
    });
  }

  attempt(async () => {
    const [schema, rows] = await Promise.all([api.labParameters(), api.sessions(), loadSets()]);
    if (gone) return;
    table = makeParameterTable(one(".table", side), systemNamed(), schema.parameters, values, () => {
      showSets();
      showChosen();
    });
    if (!mayTurn) for (const input of one(".table", side).querySelectorAll("input")) input.disabled = true;
    walks = rows.filter((/** @type {any} */ row) => row.state !== "live" && row.state !== "created");
    showWalks();
    await look();
  });

  return {
    unsaved: () => mayTurn && values.size > 0 && !isSet(),
    update(changed) {
      if (changed.has("job") && underWay.length > 0) {
        showUnderWay();
        if (
          underWay.some((run) =>
            ["finished", "failed", "cancelled"].includes(app.live.jobs.get(run.job_id)?.state ?? ""),
          )
        )
          look();
      }
    },
    close() {
      gone = true;
      side.removeEventListener("change", onChange);
      side.removeEventListener("input", onInput);
      side.removeEventListener("click", onClick);
      side.removeEventListener("submit", onSubmit);
    },
  };
}

/** @param {LabRun} run */
const isUnderWay = (run) => run.state === "queued" || run.state === "running";

/** @param {Record<string, number>} parameters */
const sorted = (parameters) => Object.entries(parameters).sort(([a], [b]) => (a < b ? -1 : 1));
