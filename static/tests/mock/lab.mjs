// The laboratory of the mock: some parameters, sets of them, runs that take a moment, and how they compare.

import { iso } from "./site.mjs";

const PARAMETERS = [
  { key: "stance.threshold", unit: "1", group: "stance", about: "", least: 0.5, most: 200, default: 8 },
  { key: "zupt_sigma_m_s", unit: "m/s", group: "zero_velocity", about: "", least: 0.001, most: 0.5, default: 0.022 },
  { key: "marker_sigma_m", unit: "m", group: "markers", about: "", least: 0.01, most: 20, default: 1 },
];
const FIGURES = [
  { name: "closure_m", unit: "m", aim: "small" },
  { name: "marker_rms_m", unit: "m", aim: "small" },
  { name: "nis_zupt", unit: "1", aim: "one" },
  { name: "process_s", unit: "s", aim: "none" },
];
const OWN = { closure_m: 2.4, marker_rms_m: 1.9, nis_zupt: 0.8, process_s: 3.1 };

export class MockLab {
  /** @param {(changes: any[]) => void} publish */
  constructor(publish) {
    this.publish = publish;
    /** @type {any[]} */
    this.sets = [];
    /** @type {any[]} */
    this.runs = [];
    /** @type {any} */
    this.site = { id: 0, set: null, parameters: {}, chosen_at: null, chosen_by: null };
  }

  /**
   * @param {string} method
   * @param {(string | undefined)[]} path after `lab`
   * @param {URLSearchParams} query
   * @param {any} given
   * @returns {{status: number, value?: unknown} | null}
   */
  answer(method, [noun, id, verb], query, given) {
    const problem = (/** @type {number} */ status, /** @type {string} */ code, /** @type {string} */ detail) => ({
      status,
      value: { type: "about:blank", title: code, status, code, detail },
    });
    const route = `${method} ${noun}${id ? "/:id" : ""}${verb ? `/${verb}` : ""}`;
    switch (route) {
      case "GET parameters":
        return {
          status: 200,
          value: { engine_version: "0.1.0", engine_sha256: "e1".repeat(32), parameters: PARAMETERS },
        };
      case "GET parameter-sets":
        return { status: 200, value: this.sets };
      case "GET site-parameters":
        return { status: 200, value: this.site };
      case "PUT site-parameters": {
        const set = this.sets.find((s) => s.id === given.parameter_set_id);
        if (set && given.version !== set.version)
          return problem(409, "set_changed", "expected the version that stands, found another");
        const named = set ? { id: set.id, name: set.name, version: set.version } : null;
        this.site = {
          id: this.site.id + 1,
          set: named,
          parameters: set?.parameters ?? {},
          chosen_at: iso(0),
          chosen_by: "Chen Wei",
        };
        return { status: 200, value: this.site };
      }
      case "POST parameter-sets": {
        const set = {
          id: `p${this.sets.length + 1}`,
          about: "",
          ...given,
          version: 1,
          created_at: iso(0),
          created_by: null,
          updated_at: iso(0),
        };
        this.sets.push(set);
        return { status: 201, value: set };
      }
      case "PUT parameter-sets/:id": {
        const set = this.sets.find((s) => s.id === id);
        if (given.version !== set.version)
          return problem(409, "set_changed", "expected the version that stands, found another");
        return { status: 200, value: Object.assign(set, given, { version: set.version + 1 }) };
      }
      case "DELETE parameter-sets/:id":
        this.sets = this.sets.filter((s) => s.id !== id);
        return { status: 204 };
      case "POST runs": {
        const made = given.session_ids.map((/** @type {string} */ session_id) => {
          const n = this.runs.length + 1;
          const set = this.sets.find((s) => s.id === given.parameter_set_id);
          const run = {
            id: `r${n}`,
            session_id,
            job_id: `jr${n}`,
            name: set?.name ?? given.name ?? given.aids?.join(" + ") ?? "default",
            parameter_set_id: set?.id ?? null,
            parameters: given.parameters ?? {},
            aids: given.aids ?? null,
            solution: given.solution ?? "smoothed",
            state: "queued",
            created_at: iso(0),
            figures: null,
            provenance: null,
          };
          this.runs.push(run);
          setTimeout(() => this.step(run, "running", 0.4), 150);
          setTimeout(() => this.step(run, "finished", 1), 600);
          return run;
        });
        return { status: 202, value: structuredClone(made) };
      }
      case "GET runs": {
        return {
          status: 200,
          value: this.runs.filter((run) => !query.has("session_id") || run.session_id === query.get("session_id")),
        };
      }
      case "GET runs/:id":
        return { status: 200, value: this.runs.find((r) => r.id === id) };
      case "POST runs/:id/cancel": {
        const run = this.runs.find((r) => r.id === id);
        run.state = "cancelled";
        return { status: 200, value: run };
      }
      case "DELETE runs/:id":
        this.runs = this.runs.filter((r) => r.id !== id);
        return { status: 204 };
      case "GET comparison":
        return {
          status: 200,
          value: {
            figures: FIGURES,
            rows: (query.get("session_ids") ?? "").split(",").flatMap((session) => this.rows(session)),
          },
        };
      default:
        return null;
    }
  }

  /**
   * A run comes farther, unless it was given up.
   * @param {any} run
   * @param {string} state
   * @param {number} progress
   */
  step(run, state, progress) {
    if (run.state === "cancelled") return;
    run.state = state;
    this.publish([
      {
        kind: "job",
        job: { id: run.job_id, session_id: run.session_id, lab_run_id: run.id, state, stage: "filtering", progress },
      },
    ]);
  }

  /** @param {string} session_id */
  rows(session_id) {
    const walk = {
      session_id,
      title: session_id === "s9" ? "Spiral, evening" : "Second team",
      inspector: "Chen Wei",
      started_at: iso(-9e6),
      comparable: null,
    };
    const from = {
      engine_version: "0.1.0",
      engine_sha256: "e1".repeat(32),
      aids: ["zupt", "heading"],
      solution: "smoothed",
      inputs: [{ foot: "left", source: "log", sha256: "ab".repeat(32), samples: 1000 }],
      visits_sha256: "cd".repeat(32),
      visits: 9,
      config_sha256: "ef".repeat(32),
      track_sha256: "01".repeat(32),
      parameters: {},
    };
    const done = this.runs.filter((run) => run.session_id === session_id && run.state === "finished");
    return [
      {
        ...walk,
        run_id: null,
        run: "default",
        parameters: {},
        aids: null,
        values: OWN,
        differences: {},
        provenance: from,
      },
      ...done.map((run) => {
        const values = { closure_m: 1.9, marker_rms_m: 2.3, nis_zupt: 1.05, process_s: 3 };
        const differences = Object.fromEntries(
          Object.entries(values).map(([name, value]) => [name, value - OWN[/** @type {keyof typeof OWN} */ (name)]]),
        );
        return {
          ...walk,
          run_id: run.id,
          run: run.name,
          parameters: run.parameters,
          aids: run.aids,
          values,
          differences,
          comparable: true,
          provenance: { ...from, parameters: run.parameters },
        };
      }),
    ];
  }
}
