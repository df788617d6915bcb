// Handing in a walk at the dock: a file for each stream of its system dropped and looked at, who it was and where it began, and
// then a link to the track.

import * as api from "../api.js";
import { bytes, duration, percent } from "../format.js";
import { html, one, render, setAttribute, setText } from "../html.js";
import { t, tOr, translate } from "../i18n.js";
import { learnSystems, openSystem, systemNamed, systemNames, word } from "../systems/index.js";
import { forbidden } from "../ui/forbidden.js";
import { problemBox } from "../ui/problem.js";
import { uploadForm } from "./form.js";
import { exchanged, makePreviewPanel } from "./preview_panel.js";
import { TimeLeft } from "./preview.js";
import { rememberUpload, unfinishedUpload } from "./remembered_upload.js";
import { runUpload } from "./run.js";
import { readStart } from "./start.js";
import { sameFile } from "./transfer.js";
import { alreadyHere, chosen, knownWalks, logQuery, waitingList, whose } from "./waiting.js";

/** The choice of somebody who has no name here yet. */
const SOMEBODY_NEW = "new";

/** @type {import("../ui/router.js").MakeView} */
export function uploadView(app, side, argument) {
  const named = unfinishedUpload()?.system ?? (argument || undefined);
  const system = systemNamed(named);
  const slots = system.uploadSlots;
  /** @type {import("./run.js").Files} by stream */
  let files = {};
  /** @type {File | null} */
  let visits = null;
  let busy = false;
  /** @type {import("./waiting.js").WaitingWalk[]} */
  let waits = [];
  const refused = forbidden(app, "walk");
  let gone = false;
  const left = new TimeLeft();
  render(side, uploadForm(system, refused));
  translate(side);

  const form = /** @type {HTMLFormElement} */ (one("form", side));
  const go = /** @type {HTMLButtonElement} */ (one(".go", side));
  const dry = /** @type {HTMLButtonElement} */ (one(".dry", side));
  const picker = /** @type {HTMLInputElement} */ (one("input[type=file]", side));
  const drop = one(".drop", side);
  const looking = makePreviewPanel(app, side, system, (stream) => files[stream], showWaiting);
  const cardOf = (/** @type {string} */ stream) => one(`[data-stream="${CSS.escape(stream)}"]`, side);
  const field = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (form.elements.namedItem(name));

  /** @param {Iterable<File>} chosen */
  function take(chosen) {
    if (busy) return;
    for (const file of chosen) {
      if (/visit|访问|打点/iu.test(file.name)) visits = file;
      else if (system.instrument && /\.toml$/iu.test(file.name))
        file.text().then((text) => (field("instrument").value = text));
      else {
        // By its name; without one that says, the stream that is still free.
        const free = slots.find(({ stream }) => !files[stream]) ?? slots.at(-1);
        const which = system.slotOf(file.name) ?? free?.stream;
        if (!which) continue;
        files[which] = file;
        looking.anew(which);
      }
    }
    render(one(".answer", side), html``);
    showFiles();
  }

  function showFiles() {
    for (const { stream } of slots) {
      const box = cardOf(stream);
      const file = files[stream];
      setText(one(".file", box), file ? file.name : t("upload.no_file"));
      setAttribute(one(".file", box), "class", file ? "file" : "file muted");
      setText(one(".state", box), file ? bytes(file.size) : "");
      one("[data-take-off]", box).hidden = !file || busy;
    }
    setText(
      one(".visits-file", side),
      visits ? t("upload.visits_file", { file: visits.name }) : system.placesItself ? "" : t("upload.visits_none"),
    );
    const swap = /** @type {HTMLButtonElement | null} */ (side.querySelector(".swap"));
    if (swap) swap.disabled = busy || Object.keys(files).length === 0;
    go.disabled = !ready();
    dry.disabled = go.disabled;
    showSame();
  }

  /** One file for two streams is a slip: each sensor writes its own. */
  async function showSame() {
    const given = () => Object.values(files).filter((file) => file !== undefined);
    const chosen = given();
    /** @type {[File, File] | null} */
    let same = null;
    for (const [i, first] of chosen.entries())
      for (const second of chosen.slice(i + 1)) if (!same && (await sameFile(first, second))) same = [first, second];
    // Others have been chosen meanwhile: they are looked at by themselves.
    if (given().length !== chosen.length || given().some((file, i) => file !== chosen[i])) return;
    render(
      one(".same", side),
      same
        ? html`<p class="warning" data-testid="same-file">
            ${word(system, "upload.same_file", { first: same[0].name, second: same[1].name })}
          </p>`
        : html``,
    );
  }

  /** A file that was not meant is not sent. @param {string} stream */
  function takeOff(stream) {
    if (busy) return;
    delete files[stream];
    looking.anew(stream);
    render(one(".answer", side), html``);
    showFiles();
  }

  /** What was said of a walk that is in is not said of the next one. */
  function clearFacts() {
    for (const name of ["inspector", "new_name", "title", "started_at", "marker", "heading"])
      if (form.elements.namedItem(name)) field(name).value = "";
    showInspectors();
    showStart();
  }

  const ready = () =>
    !busy &&
    refused === null &&
    slots.some(({ stream }) => files[stream]) &&
    slots.every(({ stream, required }) => !required || files[stream]);

  async function showInspectors() {
    const chosen = field("inspector").value;
    const everybody = await api.inspectors().catch(() => [...app.live.inspectors.values()]);
    const list = everybody.filter(
      (/** @type {import("../state/live.js").Inspector} */ { id, kind = "person" }) =>
        app.writesFor(id) && (kind === "person" || kind === system.carrierKind),
    );
    render(
      one("[name=inspector]", side),
      html`<option value="">${t("upload.choose_inspector")}</option>
        ${app.may("dispatch") && html`<option value="${SOMEBODY_NEW}">${t(system.carrierKind === "person" ? "upload.somebody_new" : "upload.new_instrument")}</option>`}${list.map((i) => html`<option value="${i.id}">${i.name}</option>`)}`,
    );
    // Where there are several nobody is chosen by chance: a log would go to the wrong one.
    const only = list.length === 1 ? list[0].id : "";
    field("inspector").value = chosen === SOMEBODY_NEW || list.some((i) => i.id === chosen) ? chosen : only;
    showNewName();
  }

  function showNewName() {
    one(".new-name", side).hidden = field("inspector").value !== SOMEBODY_NEW;
  }

  function showStart() {
    if (system.placesItself) return;
    const kind = String(new FormData(form).get("start"));
    one(".start-marker", side).hidden = kind !== "marker";
    one(".start-position", side).hidden = kind !== "position";
    const typed = field("marker").value.trim();
    const node = app.grid.named(typed);
    setText(
      one(".marker-check", side),
      typed === ""
        ? ""
        : node
          ? `E ${node.e_m.toFixed(1)} · N ${node.n_m.toFixed(1)} m`
          : t("upload.marker_unknown", { name: typed }),
    );
  }

  /** Of which system the walk is, where there are several. */
  function showSystems() {
    const names = systemNames();
    render(
      one(".systems", side),
      names.length > 1
        ? html`<label class="field"
            ><span>${t("upload.system")}</span
            ><select name="system">
              ${names.map((name) => html`<option value="${name}" ${name === system.name && "selected"}>${word(systemNamed(name), "title")}</option>`)}
            </select></label
          >`
        : html``,
    );
  }

  function showUnfinished() {
    const left = unfinishedUpload();
    render(
      one(".unfinished", side),
      left
        ? html`<div class="block" role="status" data-testid="unfinished">
            <h2>${t(Object.keys(left.logs).length > 0 ? "upload.unfinished" : "upload.waits_for_logs")}</h2>
            <p><b data-testid="unfinished-whose">${whose(left)}</b></p>
            <p>${unfinishedWords(left)}</p>
            <button type="button" class="discard">${t("upload.discard")}</button>
          </div>`
        : html``,
    );
    one(".session-facts", side).hidden = left !== null;
    one(".systems", side).hidden = left !== null;
    one(".open-walk", side).hidden = left !== null;
  }

  /** The walks that wait, the likeliest for what was chosen first. */
  async function showWaiting() {
    const query = logQuery(looking.previews());
    const inspector = field("inspector").value;
    if (inspector && inspector !== SOMEBODY_NEW && unfinishedUpload() === null && Object.keys(files).length > 0)
      query.set("inspector_id", inspector);
    const walks = await api.waitingSessions(query).catch(() => []);
    if (gone) return;
    waits = unfinishedUpload() ? [] : walks.filter((walk) => app.writesFor(walk.inspector_id));
    render(one(".waiting", side), waitingList(waits));
  }

  /** @param {string} id */
  function choose(id) {
    const walk = waits.find((one) => one.id === id);
    if (!walk || busy) return;
    rememberUpload(chosen(walk));
    if (walk.system !== system.name) return dispatchEvent(new HashChangeEvent("hashchange"));
    showUnfinished();
    showWaiting();
  }

  async function submit(dryRun = false, anyway = false) {
    const unfinished = unfinishedUpload();
    const data = new FormData(form);
    busy = true;
    showFiles();
    render(one(".answer", side), html``);
    try {
      if (!dryRun && !anyway && !Object.keys(unfinished?.logs ?? {}).length) {
        const given = Object.values(files).filter((file) => file !== undefined);
        const known = await knownWalks(api, given, unfinished?.session_id).catch(() => []);
        if (known.length > 0) {
          render(one(".answer", side), alreadyHere(known));
          busy = false;
          showFiles();
          return;
        }
      }
      const session = unfinished ? {} : await describe(data);
      const { session_id, unchanged, looked } = await runUpload(api, system, {
        files,
        visits,
        session,
        unfinished,
        readings: looking.readings(),
        dryRun,
        onLog: showLog,
        onJob: showJob,
        remember: rememberUpload,
      });
      if (dryRun) {
        for (const [stream, seen] of Object.entries(looked)) looking.found(stream, seen);
        const fine = Object.values(looked).every((seen) => !seen.problem);
        render(
          one(".answer", side),
          html`<div class="done" role="status" data-testid="dry-run-done">
            <b>${t(unchanged ? "upload.dry_unchanged" : fine ? "upload.dry_fine" : "upload.dry_wrong")}</b>
          </div>`,
        );
        one(".working", side).hidden = true;
        busy = false;
        showUnfinished();
        go.disabled = !ready();
        dry.disabled = go.disabled;
        return;
      }
      render(
        one(".answer", side),
        html`<div class="done" role="status" data-testid="upload-done">
          <b>${t(unchanged ? "upload.done_unchanged" : "upload.done")}</b>
          <p><a href="#/sessions/${encodeURIComponent(session_id)}">${t("upload.open")}</a></p>
        </div>`,
      );
      files = {};
      showSame();
      looking.clear();
      visits = null;
      clearFacts();
    } catch (error) {
      render(one(".answer", side), problemBox(error));
      // What did not get through shows no full bar beside the refusal.
      for (const box of side.querySelectorAll(".slot:not([data-stage=accepted], [data-stage=unchanged])")) {
        one("progress", box).hidden = true;
        setText(one(".state", box), "");
      }
    }
    one(".working", side).hidden = true;
    busy = false;
    showUnfinished();
    showWaiting();
    go.disabled = !ready();
    dry.disabled = go.disabled;
  }

  /** Gives an upload up. A session that got no log goes with it; one that holds a stream's samples stays. */
  async function discard() {
    const left = unfinishedUpload();
    rememberUpload(null);
    showUnfinished();
    showWaiting();
    if (!left || left.waits) return;
    try {
      const { logs } = await api.session(left.session_id);
      if (!logs.some((/** @type {{state: string}} */ log) => log.state === "accepted"))
        await api.deleteSession(left.session_id);
    } catch (error) {
      // Somebody else has deleted it: what was wanted.
      if (!(error instanceof api.Problem && error.status === 404)) render(one(".answer", side), problemBox(error));
    }
  }

  /** @param {FormData} data */
  async function describe(data) {
    const start = readStart(data, (name) => app.grid.named(name)?.name);
    let inspector_id = String(data.get("inspector") ?? "");
    if (inspector_id === "") throw new Error(t("upload.need_inspector"));
    if (inspector_id === SOMEBODY_NEW) {
      const name = String(data.get("new_name") ?? "").trim();
      if (name === "") throw new Error(t("upload.need_name"));
      inspector_id = (await api.createInspector(name, system.carrierKind || "person")).id;
      await showInspectors();
      field("inspector").value = inspector_id;
      showNewName();
    }
    const title = String(data.get("title") ?? "").trim();
    const started = String(data.get("started_at") ?? "");
    return {
      inspector_id,
      ...(title ? { title } : {}),
      // What is typed is site time.
      ...(started ? { started_at: new Date(`${started}+08:00`).toISOString() } : {}),
      ...start,
      ...instrument(data),
    };
  }

  /** What the instrument is like, where the system asks for it. @param {FormData} data */
  function instrument(data) {
    if (!system.instrument) return {};
    const text = String(data.get("instrument") ?? "").trim();
    if (text === "") throw new Error(t("upload.need_instrument"));
    return { instrument: text };
  }

  /**
   * @param {string} stream
   * @param {import("./transfer.js").Progress} progress
   */
  function showLog(stream, progress) {
    const box = cardOf(stream);
    const bar = /** @type {HTMLProgressElement} */ (one("progress", box));
    bar.hidden = false;
    const part = progress.total > 0 ? progress.done / progress.total : 0;
    if (progress.stage !== "waiting") bar.value = part;
    box.dataset.stage = progress.stage;
    setText(
      one(".state", box),
      t(`upload.stage.${progress.stage}`, {
        done: bytes(progress.done),
        total: bytes(progress.total),
        percent: percent(part),
      }) + timeLeft(`${stream} ${progress.stage}`, part),
    );
  }

  /**
   * @param {string} what
   * @param {number} done 0 to 1
   */
  function timeLeft(what, done) {
    const s = left.of(what, done);
    return s === null || done >= 1 ? "" : ` · ${t("upload.time_remaining", { time: duration(s) })}`;
  }

  /** @param {import("../state/live.js").Job} job */
  function showJob(job) {
    const box = one(".working", side);
    box.hidden = false;
    const done = job.progress ?? 0;
    /** @type {HTMLProgressElement} */ (one("progress", box)).value = done;
    // Ids are in the order in which jobs were queued.
    const before = [...app.live.jobs.values()].filter(
      (other) => other.state === "running" || (other.state === "queued" && !other.lab_run_id && other.id < job.id),
    ).length;
    setText(
      one(".words", box),
      job.state === "queued"
        ? t("upload.queued", { n: before })
        : t("upload.processing", { stage: tOr(`job.stage.${job.stage}`, job.stage ?? ""), percent: percent(done) }) +
            timeLeft(`${job.id} ${job.stage}`, done),
    );
  }

  one(".choose", side).addEventListener("click", () => picker.click());
  picker.addEventListener("change", () => {
    take(picker.files ?? []);
    picker.value = "";
  });
  drop.addEventListener("dragover", (event) => {
    event.preventDefault();
    drop.classList.add("over");
  });
  drop.addEventListener("dragleave", () => drop.classList.remove("over"));
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    take(event.dataTransfer?.files ?? []);
  });
  one(".slots", side).addEventListener("click", (event) => {
    const off = /** @type {HTMLElement} */ (event.target).closest("[data-take-off]")?.getAttribute("data-take-off");
    if (off) takeOff(off);
  });
  side.querySelector(".swap")?.addEventListener("click", () => {
    if (busy) return;
    files = exchanged(files, slots);
    looking.swap();
    showFiles();
  });
  one(".open-walk", side).addEventListener("click", async () => {
    if (busy || refused !== null) return;
    try {
      const streams = slots.map(({ stream }) => stream);
      const walk = await api.createSession({ ...(await describe(new FormData(form))), ...system.sessionBody(streams) });
      location.hash = `#/sessions/${encodeURIComponent(walk.id)}`;
    } catch (error) {
      render(one(".answer", side), problemBox(error));
    }
  });
  dry.addEventListener("click", () => {
    if (!busy) submit(true);
  });
  one(".systems", side).addEventListener("change", (event) => {
    const { value } = /** @type {HTMLSelectElement} */ (event.target);
    location.hash = `#/upload/${encodeURIComponent(value)}`;
  });
  form.addEventListener("input", () => {
    showNewName();
    showStart();
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (!busy) submit();
  });
  one(".waiting", side).addEventListener("click", (event) => {
    const id = /** @type {HTMLElement} */ (event.target).closest("[data-waiting]")?.getAttribute("data-waiting");
    if (id) choose(id);
  });
  one(".answer", side).addEventListener("click", (event) => {
    if (/** @type {HTMLElement} */ (event.target).closest(".anyway") && !busy) submit(false, true);
  });
  one(".unfinished", side).addEventListener("click", (event) => {
    if (!(/** @type {HTMLElement} */ (event.target).closest(".discard"))) return;
    discard();
  });
  // A file that misses the box must not replace the page.
  const guard = (/** @type {Event} */ event) => event.preventDefault();
  addEventListener("dragover", guard);
  addEventListener("drop", guard);
  const warn = (/** @type {BeforeUnloadEvent} */ event) => {
    if (busy) event.preventDefault();
  };
  addEventListener("beforeunload", warn);

  showFiles();
  showInspectors();
  showStart();
  showUnfinished();
  showWaiting();
  showSystems();
  learnSystems(api).then(async () => {
    await openSystem(named);
    if (gone) return;
    // What it is of is known now: the screen anew, by the router.
    if (systemNamed(named) !== system) dispatchEvent(new HashChangeEvent("hashchange"));
    else showSystems();
  });
  return {
    close() {
      gone = true;
      removeEventListener("dragover", guard);
      removeEventListener("drop", guard);
      removeEventListener("beforeunload", warn);
    },
  };
}

/** @param {import("./remembered_upload.js").Unfinished} left */
function unfinishedWords(left) {
  const names = Object.values(left.logs).map((log) => log?.name);
  return names.length > 0 ? t("upload.unfinished_how", { files: names.join(", ") }) : t("upload.unfinished_open");
}
