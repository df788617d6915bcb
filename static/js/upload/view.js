// Handing in a walk at the dock: two files dropped and looked at, who it was and where it began, and then a
// link to the track.

import * as api from "../api.js";
import { bytes, duration, percent } from "../format.js";
import { html, one, render, setAttribute, setText } from "../html.js";
import { t, tOr, translate } from "../i18n.js";
import { mayNot } from "../ui/may_not.js";
import { problemBox } from "../ui/problem.js";
import { makeLooking } from "./looking.js";
import { TimeLeft } from "./preview.js";
import { rememberUpload, unfinishedUpload } from "./remembered_upload.js";
import { runUpload } from "./run.js";
import { readStart } from "./start.js";
import { footOf, sameFile } from "./transfer.js";

/** @typedef {import("./run.js").Foot} Foot */
const FEET = /** @type {const} */ (["left", "right"]);

/** @type {import("../ui/router.js").MakeView} */
export function uploadView(app, side) {
  /** @type {Partial<Record<Foot, File>>} */
  let files = {};
  /** @type {File | null} */
  let visits = null;
  let busy = false;
  const refused = mayNot(app, "walk");
  const left = new TimeLeft();
  const foot = (/** @type {Foot} */ name) =>
    html` <div class="foot" data-foot="${name}" data-testid="foot-${name}">
      <h3 data-t="foot.${name}"></h3>
      <p class="file muted"></p>
      <p class="muted state" aria-live="polite"></p>
      <progress max="1" value="0" hidden></progress>
      <div class="preview" data-testid="preview-${name}"></div>
    </div>`;

  render(
    side,
    html`<div class="page">
      <h1 data-t="upload.title"></h1>
      <p class="lead" data-t="upload.lead"></p>
      ${refused}
      <div class="unfinished"></div>
      <form novalidate>
        <div class="block">
          <h2 data-t="upload.files"></h2>
          <div class="drop" data-testid="drop">
            <b data-t="upload.drop"></b>
            <p class="muted" data-t="upload.formats"></p>
            <button type="button" class="choose" data-t="upload.choose"></button>
            <input type="file" multiple hidden data-testid="files" accept=".csv,.txt,.log,.bin,.dat,.gz,.zst" />
          </div>
          <div class="feet">
            ${foot("left")}<button type="button" class="swap" data-t="upload.swap"></button>${foot("right")}
          </div>
          <div class="same" role="status"></div>
          <p class="in-time" role="status" data-testid="in-time"></p>
          <div class="ask-mapping"></div>
          <p class="visits-file muted"></p>
        </div>
        <div class="block session-facts">
          <h2 data-t="upload.walk"></h2>
          <div class="two">
            <label class="field"
              ><span data-t="upload.inspector"></span
              ><select name="inspector"></select
            ></label>
            <label class="field new-name"
              ><span data-t="upload.new_inspector"></span><input name="new_name" autocomplete="off"
            /></label>
          </div>
          <div class="two">
            <label class="field"><span data-t="upload.name"></span><input name="title" autocomplete="off" /></label>
            <label class="field"
              ><span data-t="upload.started_at"></span><input name="started_at" type="datetime-local"
            /></label>
          </div>
          <fieldset>
            <legend data-t="upload.start"></legend>
            <div class="choices">
              <label
                ><input type="radio" name="start" value="marker" checked /><span data-t="upload.start_marker"></span
              ></label>
              <label
                ><input type="radio" name="start" value="position" /><span data-t="upload.start_position"></span
              ></label>
              <label
                ><input type="radio" name="start" value="origin" /><span data-t="upload.start_origin"></span
              ></label>
            </div>
          </fieldset>
          <div class="start-marker two">
            <label class="field"
              ><span data-t="upload.marker"></span
              ><input name="marker" autocomplete="off" autocapitalize="characters" spellcheck="false"
            /></label>
            <p class="muted marker-check"></p>
          </div>
          <div class="start-position three" hidden>
            ${["east", "north", "up"].map((axis) => html`<label class="field"><span data-t="axis.${axis}_m"></span><input name="${axis}" inputmode="decimal" autocomplete="off" value="${axis === "up" ? "0" : ""}" /></label>`)}
          </div>
          <label class="field"
            ><span data-t="upload.heading"></span><input name="heading" inputmode="decimal" autocomplete="off"
          /></label>
        </div>
        <div class="answer" aria-live="polite"></div>
        <div class="block working" hidden>
          <p class="words"></p>
          <progress max="1" value="0"></progress>
        </div>
        <div class="row end">
          <button type="button" class="dry" data-t="upload.dry_run" data-testid="dry-run"></button
          ><button class="main-action go" data-t="upload.go"></button>
        </div>
      </form>
    </div>`,
  );
  translate(side);

  const form = /** @type {HTMLFormElement} */ (one("form", side));
  const go = /** @type {HTMLButtonElement} */ (one(".go", side));
  const dry = /** @type {HTMLButtonElement} */ (one(".dry", side));
  const picker = /** @type {HTMLInputElement} */ (one("input[type=file]", side));
  const drop = one(".drop", side);
  const looking = makeLooking(app, side, (name) => files[name]);
  const field = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (form.elements.namedItem(name));

  /** @param {Iterable<File>} chosen */
  function take(chosen) {
    if (busy) return;
    for (const file of chosen) {
      if (/visit|访问|打点/iu.test(file.name)) visits = file;
      else {
        // By its name; without one that says, the foot that is still free.
        const which = footOf(file.name) ?? (files.left ? "right" : "left");
        files[which] = file;
        looking.anew(which);
      }
    }
    render(one(".answer", side), html``);
    showFiles();
  }

  function showFiles() {
    for (const name of FEET) {
      const box = one(`[data-foot=${name}]`, side);
      const file = files[name];
      setText(one(".file", box), file ? file.name : t("upload.no_file"));
      setAttribute(one(".file", box), "class", file ? "file" : "file muted");
      setText(one(".state", box), file ? bytes(file.size) : "");
    }
    setText(
      one(".visits-file", side),
      visits ? t("upload.visits_file", { file: visits.name }) : t("upload.visits_none"),
    );
    /** @type {HTMLButtonElement} */ (one(".swap", side)).disabled = busy || (!files.left && !files.right);
    go.disabled = !ready();
    dry.disabled = go.disabled;
    showSame();
  }

  /** One file for both feet is a slip: each sensor writes its own. */
  async function showSame() {
    const { left: one_foot, right: other } = files;
    const same = one_foot && other ? await sameFile(one_foot, other) : false;
    if (files.left !== one_foot || files.right !== other) return;
    render(
      one(".same", side),
      same
        ? html`<p class="warning" data-testid="same-file">
            ${t("upload.same_file", { left: one_foot?.name ?? "", right: other?.name ?? "" })}
          </p>`
        : html``,
    );
  }

  const ready = () => !busy && refused === null && Boolean(files.left || files.right);

  async function showInspectors() {
    const chosen = field("inspector").value;
    const everybody = await api.inspectors().catch(() => [...app.live.inspectors.values()]);
    const list = everybody.filter((/** @type {{id: string}} */ one) => app.writesFor(one.id));
    render(
      one("select", side),
      html`${app.may("dispatch") && html`<option value="">${t("upload.somebody_new")}</option>`}${list.map((i) => html`<option value="${i.id}">${i.name}</option>`)}`,
    );
    field("inspector").value = list.some((i) => i.id === chosen) ? chosen : (list[0]?.id ?? "");
    showNewName();
  }

  function showNewName() {
    one(".new-name", side).hidden = field("inspector").value !== "" || !app.may("dispatch");
  }

  function showStart() {
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

  function showUnfinished() {
    const left = unfinishedUpload();
    render(
      one(".unfinished", side),
      left
        ? html`<div class="block" role="status" data-testid="unfinished">
            <h2>${t(Object.keys(left.logs).length > 0 ? "upload.unfinished" : "upload.waits_for_logs")}</h2>
            <p>${unfinishedWords(left)}</p>
            <p></p>
            <button type="button" class="discard">${t("upload.discard")}</button>
          </div>`
        : html``,
    );
    one(".session-facts", side).hidden = left !== null;
  }

  async function submit(dryRun = false) {
    const unfinished = unfinishedUpload();
    const data = new FormData(form);
    busy = true;
    showFiles();
    render(one(".answer", side), html``);
    try {
      const session = unfinished ? {} : await describe(data);
      const { session_id, unchanged, looked } = await runUpload(api, {
        files,
        visits,
        session,
        unfinished,
        readings: looking.readings(),
        dryRun,
        onFoot: showFoot,
        onJob: showJob,
        remember: rememberUpload,
      });
      if (dryRun) {
        for (const name of FEET) {
          const seen = looked[name];
          if (!seen) continue;
          looking.found(name, seen);
        }
        const fine = FEET.every((name) => !looked[name]?.problem);
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
    } catch (error) {
      render(one(".answer", side), problemBox(error));
      // What did not get through shows no full bar beside the refusal.
      for (const box of side.querySelectorAll(".foot:not([data-stage=accepted], [data-stage=unchanged])")) {
        one("progress", box).hidden = true;
        setText(one(".state", box), "");
      }
    }
    one(".working", side).hidden = true;
    busy = false;
    showUnfinished();
    go.disabled = !ready();
    dry.disabled = go.disabled;
  }

  /** Gives an upload up. A session that got no log goes with it; one that holds a foot's samples stays. */
  async function discard() {
    const left = unfinishedUpload();
    rememberUpload(null);
    showUnfinished();
    if (!left) return;
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
    if (inspector_id === "") {
      const name = String(data.get("new_name") ?? "").trim();
      if (name === "") throw new Error(t("upload.need_name"));
      inspector_id = (await api.createInspector(name)).id;
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
    };
  }

  /**
   * @param {Foot} name
   * @param {import("./transfer.js").Progress} progress
   */
  function showFoot(name, progress) {
    const box = one(`[data-foot=${name}]`, side);
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
      }) + timeLeft(`${name} ${progress.stage}`, part),
    );
  }

  /**
   * @param {string} what
   * @param {number} done 0 to 1
   */
  function timeLeft(what, done) {
    const s = left.of(what, done);
    return s === null || done >= 1 ? "" : ` · ${t("upload.time_left", { time: duration(s) })}`;
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
  one(".swap", side).addEventListener("click", () => {
    if (busy) return;
    files = { left: files.right, right: files.left };
    looking.swap();
    showFiles();
  });
  dry.addEventListener("click", () => {
    if (!busy) submit(true);
  });
  form.addEventListener("input", () => {
    showNewName();
    showStart();
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (!busy) submit();
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
  return {
    close() {
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
