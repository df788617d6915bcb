// The markers of the mock server: edited with versions and history, and by files that are compared, applied and reverted.

import { iso } from "./site.mjs";

export class MockMarkers {
  /** @param {{name: string, e_m: number, n_m: number, u_m: number}[]} nodes */
  constructor(nodes) {
    this.revision = 7;
    /** @type {Map<string, any>} */
    this.table = new Map(
      nodes.map(({ name, e_m, n_m, u_m }) => [
        name,
        { name, e_m, n_m, u_m, version: 7, created_at: iso(-9e8), updated_at: iso(-9e8) },
      ]),
    );
    /** @type {any[]} */
    this.changes = [];
    /** @type {Map<string, any>} */
    this.imports = new Map();
  }

  /**
   * @param {string} method
   * @param {string[]} path below /markers
   * @param {URL} url
   * @param {string} body
   * @returns {{status: number, value: any} | null} null: no such route
   */
  answer(method, [first, second, third], url, body) {
    const json = () => JSON.parse(body || "{}");
    if (first === undefined) {
      if (method === "GET") return ok([...this.table.values()]);
      const { name, reason, ...place } = json();
      if (this.table.has(name))
        return problem(409, "marker_exists", `there is already a marker ${name}`, this.table.get(name));
      this.write([{ name, before: null, after: whole(place) }], { reason });
      return { status: 201, value: this.table.get(name) };
    }
    if (first === "residuals")
      return ok({
        sigma_m: 1.9,
        markers: [this.residual("A17", true, [2.6, 1.5]), this.residual("B112", false, [0.4, -0.2])],
      });
    if (first === "imports") return this.answerImport(method, second, third, url, body, json);
    const marker = this.table.get(first);
    if (second === "history") return ok(this.changes.filter((c) => c.marker === first).reverse());
    if (second === "residuals")
      return ok(
        ["A17", "B112"].includes(first)
          ? [
              {
                marker: first,
                session_id: "s9",
                t_applied_ns: 1,
                visited_at: iso(-8e6),
                accepted: true,
                nis: 2.1,
                residual_m: [2.6, 1.5],
              },
            ]
          : [],
      );
    if (!marker) return problem(404, "marker_not_found", `there is no marker ${first}`);
    if (method === "GET") return ok(marker);
    const { reason, version, ...place } =
      method === "DELETE"
        ? { reason: url.searchParams.get("reason"), version: Number(url.searchParams.get("version")) }
        : json();
    if (version !== marker.version)
      return problem(409, "marker_changed", `expected ${first} in version ${version}, found ${marker.version}`, marker);
    this.write([{ name: first, before: whole(marker), after: method === "DELETE" ? null : whole(place) }], { reason });
    return method === "DELETE" ? { status: 204, value: null } : ok(this.table.get(first));
  }

  /** @param {any[]} steps @param {{reason?: string, import_id?: string | null, is_revert?: boolean}} cause */
  write(steps, { reason = "", import_id = null, is_revert = false }) {
    this.revision += 1;
    for (const { name, before, after } of steps) {
      if (after)
        this.table.set(name, {
          created_at: iso(0),
          ...this.table.get(name),
          name,
          ...after,
          version: this.revision,
          updated_at: iso(0),
        });
      else this.table.delete(name);
      this.changes.push({
        marker: name,
        revision: this.revision,
        changed_at: iso(0),
        changed_by: null,
        reason,
        import_id,
        is_revert,
        before,
        after,
      });
    }
  }

  /** @param {string} marker @param {boolean} suspect @param {number[]} mean_m */
  residual(marker, suspect, mean_m) {
    return {
      marker,
      visits: 6,
      rejected: 1,
      sessions: 4,
      mean_m,
      mean_length_m: Math.hypot(...mean_m),
      mean_direction_deg: 60,
      rms_m: 3.1,
      largest_m: 4.2,
      p_value: suspect ? 1e-5 : 0.6,
      suspect,
    };
  }

  /** @param {string} method @param {string} id @param {string} part @param {URL} url @param {string} body @param {() => any} json */
  answerImport(method, id, part, url, body, json) {
    if (id === undefined) {
      if (method === "GET")
        return ok([...this.imports.values()].reverse().map(({ file, differences, findings, ...row }) => row));
      const one = {
        id: `m${this.imports.size + 1}`,
        state: "compared",
        file_name: url.searchParams.get("file_name"),
        reason: "",
        created_at: iso(0),
        created_by: null,
        applied_at: null,
        applied_by: null,
        reverted_at: null,
        reverted_by: null,
        applied_revision: null,
        reverted_revision: null,
        file: body,
      };
      this.imports.set(one.id, one);
      return { status: 201, value: this.compare(one, null, false) };
    }
    const one = this.imports.get(id);
    if (!one) return problem(404, "import_not_found", `there is no import ${id}`);
    if (part === "reading") return ok(this.compare(one, json().mapping, json().whole_table));
    if (part === "apply") {
      if (one.compared_revision !== this.revision)
        return problem(
          409,
          "table_moved_on",
          `expected the table in revision ${one.compared_revision}, found ${this.revision}`,
        );
      this.write(one.differences, { reason: json().reason, import_id: id });
      return ok(Object.assign(one, { state: "applied", applied_at: iso(0), reason: json().reason }));
    }
    if (part === "revert") {
      this.write(
        one.differences.map((/** @type {any} */ d) => ({ name: d.name, before: d.after, after: d.before })),
        { import_id: id, is_revert: true },
      );
      return ok(Object.assign(one, { state: "reverted", reverted_at: iso(0) }));
    }
    if (method === "DELETE") {
      this.imports.delete(id);
      return { status: 204, value: null };
    }
    return ok(one);
  }

  /** @param {any} one @param {any} mapping @param {boolean} whole_table */
  compare(one, mapping, whole_table) {
    const [header, ...lines] = one.file
      .trim()
      .split("\n")
      .map((/** @type {string} */ line) => line.split(","));
    const at = (/** @type {string} */ word) =>
      header.findIndex((/** @type {string} */ name) => name.toLowerCase().startsWith(word));
    mapping ??=
      at("name") < 0
        ? null
        : { frame: "local", name: at("name"), e_m: at("e"), n_m: at("n_"), u_m: at("u") < 0 ? null : at("u") };
    const differences = [];
    const findings = [];
    let unchanged = 0;
    for (const [i, cells] of mapping ? lines.entries() : []) {
      const name = cells[mapping.name];
      const before = this.table.has(name) ? whole(this.table.get(name)) : null;
      const after = {
        e_m: Number(cells[mapping.e_m]),
        n_m: Number(cells[mapping.n_m]),
        u_m: mapping.u_m === null ? (before?.u_m ?? null) : Number(cells[mapping.u_m]),
      };
      const moved_m = before && Math.hypot(after.e_m - before.e_m, after.n_m - before.n_m);
      if (before && JSON.stringify(before) === JSON.stringify(after)) unchanged += 1;
      else
        differences.push({
          change: before ? "changed" : "added",
          name,
          before,
          after,
          line: i + 2,
          moved_m,
          raised_m: before && after.u_m - before.u_m,
        });
      if (moved_m > 1)
        findings.push({
          code: "far_move",
          level: "warning",
          line: i + 2,
          marker: name,
          detail: `expected a move of at most 1 m, found ${moved_m.toFixed(1)} m: check the survey`,
          figures: { largest_move_m: 1, moved_m },
          suggested: null,
        });
    }
    if (findings.length > 2)
      findings.unshift({
        code: "swapped_axes",
        level: "warning",
        line: null,
        marker: null,
        detail: "expected the table's places, found them with east and north changed over: change the two columns over",
        figures: { compared_markers: findings.length },
        suggested: { ...mapping, e_m: mapping.n_m, n_m: mapping.e_m },
      });
    if (!mapping)
      findings.push({
        code: "columns_unknown",
        level: "error",
        line: null,
        marker: null,
        detail: "expected columns for name, east and north, found none by these names: say which is which",
        figures: {},
        suggested: null,
      });
    const count = (/** @type {string} */ change) => differences.filter((d) => d.change === change).length;
    return Object.assign(one, {
      encoding: "UTF-8",
      columns: header,
      sample: lines.slice(0, 5),
      rows: lines.length,
      mapping,
      findings,
      finding_counts: {},
      differences,
      whole_table,
      added: count("added"),
      changed: count("changed"),
      removed: 0,
      unchanged,
      compared_revision: this.revision,
    });
  }
}

/** @param {any} place */
const whole = ({ e_m, n_m, u_m }) => ({ e_m, n_m, u_m: u_m ?? null });
/** @param {any} value */
const ok = (value) => ({ status: 200, value });
/** @param {number} status @param {string} code @param {string} detail @param {any} [current] */
const problem = (status, code, detail, current) => ({
  status,
  value: { type: "about:blank", title: code, status, code, detail, current },
});
