// How the server is: version, storage, the last backup, jobs.

import * as api from "../api.js";
import { bytes, dateTime, percent } from "../format.js";
import { html, one, render } from "../html.js";
import { t, tOr } from "../i18n.js";
import { problemBox } from "../ui/problem.js";

/**
 * @param {import("../app.js").App} app
 * @param {HTMLElement} box
 */
export function showServer(app, box) {
  render(
    box,
    html`<h2>${t("admin.server")}</h2>
      <div class="figures"></div>
      <div class="row backup"><button type="button">${t("admin.server.back_up")}</button></div>
      <div class="answer" aria-live="polite"></div>
      <h3>${t("admin.server.jobs")}</h3>
      <div class="jobs"></div>`,
  );
  const answer = one(".answer", box);

  async function show() {
    try {
      const server = await api.server();
      render(
        one(".figures", box),
        html` <div><b>${server.version}</b><small>${t("admin.server.version")}</small></div>
          <div><b>${dateTime(server.started_at)}</b><small>${t("admin.server.started")}</small></div>
          <div><b>${bytes(server.database_bytes)}</b><small>${t("admin.server.database")}</small></div>
          <div>
            <b>${server.free_bytes === null ? "–" : bytes(server.free_bytes)}</b
            ><small>${t("admin.server.free")}</small>
          </div>
          <div><b>${server.sessions}</b><small>${t("admin.server.sessions")}</small></div>
          <div>
            <b>${server.last_backup_at ? dateTime(server.last_backup_at) : t("admin.server.never")}</b
            ><small>${t("admin.server.last_backup")}</small>
          </div>`,
      );
      const jobs = await api.jobs();
      render(
        one(".jobs", box),
        jobs.length === 0
          ? html`<p class="muted">${t("admin.server.no_jobs")}</p>`
          : html`<table>
              <thead>
                <tr>
                  <th>${t("admin.audit.when")}</th>
                  <th>${t("admin.server.job_state")}</th>
                  <th>${t("admin.server.job_session")}</th>
                </tr>
              </thead>
              <tbody>
                ${jobs.slice(0, 50).map(
                  (job) =>
                    html`<tr>
                      <td>${dateTime(job.created_at)}</td>
                      <td>
                        ${t(`job.${job.state}`)}${job.state === "running" && html` · ${tOr(`job.stage.${job.stage}`, job.stage)} ${percent(job.progress)}`}${job.error && html`<br /><span class="bad">${job.error}</span>`}
                      </td>
                      <td>
                        <a href="#/sessions/${encodeURIComponent(job.session_id)}"
                          >${app.live.sessions.get(job.session_id)?.title || t("admin.server.open")}</a
                        >
                      </td>
                    </tr>`,
                )}
              </tbody>
            </table>`,
      );
    } catch (error) {
      render(answer, problemBox(error));
    }
  }

  one(".backup button", box).addEventListener("click", async (event) => {
    const button = /** @type {HTMLButtonElement} */ (event.currentTarget);
    button.disabled = true;
    render(answer, html`<p class="muted">${t("admin.server.backing_up")}</p>`);
    try {
      const made = await api.backUp();
      render(
        answer,
        html`<p class="done" role="status">
          ${t("admin.server.backed_up", { file: made.file, size: bytes(made.bytes) })}
        </p>`,
      );
      await show();
    } catch (error) {
      render(answer, problemBox(error));
    }
    button.disabled = false;
  });
  show();
}
