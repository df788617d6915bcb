// The faults of the mock server: steps with history, photos, and who is nearest.

import { iso } from "./site.mjs";

const AFTER = {
  open: ["acknowledged", "in_work", "fixed"],
  acknowledged: ["open", "in_work", "fixed"],
  in_work: ["open", "acknowledged", "fixed"],
  fixed: ["open", "acknowledged", "in_work", "verified"],
  verified: ["open"],
};

export class MockFaults {
  /** @param {import("./site.mjs").MockSite} site */
  constructor(site) {
    this.site = site;
    /** @type {Map<string, any[]>} */
    this.changes = new Map();
    /** @type {Map<string, any[]>} */
    this.photos = new Map();
  }

  /**
   * @param {string} method
   * @param {string[]} path below /faults
   * @param {Buffer} body
   * @returns {{status: number, value?: any, bytes?: Buffer, type?: string} | null} null: answered elsewhere
   */
  answer(method, [id, part, photoId], body) {
    if (id === undefined) return null;
    const fault = this.site.faults.find((f) => f.id === id);
    if (!fault) return problem(404, "fault_not_found", `there is no fault ${id}`);
    const photos = this.photos.get(id) ?? [];
    if (part === "history") return ok(this.changes.get(id) ?? []);
    if (part === "close") return ok(this.change(fault, { state: "verified" }));
    if (part === "nearest") {
      const [e, n] = fault.position_m;
      return ok(
        this.site.walks
          .map((walk) => {
            const [we, wn] = walk.position.position_m;
            const in_work = this.site.faults.filter(
              (f) => f.id !== id && f.state === "in_work" && f.assignee_id === walk.inspector.id,
            ).length;
            return {
              inspector_id: walk.inspector.id,
              name: walk.inspector.name,
              session_id: walk.session.id,
              distance_m: Math.hypot(we - e, wn - n),
              sigma_m: 1,
              position_age_s: 0.2,
              state: "walking",
              in_work,
              free: in_work === 0,
            };
          })
          .sort((a, b) => Number(b.free) - Number(a.free) || a.distance_m - b.distance_m),
      );
    }
    if (part === "photos" && photoId) {
      const photo = photos.find((p) => p.id === photoId);
      if (!photo) return problem(404, "photo_not_found", `there is no photo ${photoId}`);
      if (method === "GET") return { status: 200, bytes: photo.bytes, type: photo.content_type };
      this.photos.set(
        id,
        photos.filter((p) => p !== photo),
      );
      this.note(fault, { what: "photo", before: photoId, after: null });
      return { status: 204 };
    }
    if (part === "photos" && method === "POST") {
      if (body.toString("latin1", 1, 4) !== "PNG")
        return problem(
          422,
          "not_a_photo",
          "expected a JPEG, PNG or WebP picture, found something else: send the picture's own bytes",
        );
      const photo = {
        id: `p${photos.length + 1}`,
        fault_id: id,
        content_type: "image/png",
        size_bytes: body.length,
        sha256: "",
        created_at: iso(0),
        created_by: null,
        bytes: body,
      };
      this.photos.set(id, [...photos, photo]);
      this.note(fault, { what: "photo", before: null, after: photo.id });
      return { status: 201, value: bare(photo) };
    }
    if (part === "photos") return ok(photos.map(bare));
    if (method === "PATCH") {
      const { version, comment = "", ...patch } = JSON.parse(body.toString() || "{}");
      if (version !== undefined && version !== (fault.version ?? 1))
        return problem(409, "fault_changed", `expected the fault in version ${version}, found ${fault.version}`, fault);
      if (patch.state && patch.state !== fault.state && !AFTER[fault.state].includes(patch.state))
        return problem(409, "wrong_step", `expected a step that follows on ${fault.state}`, fault);
      return ok(this.change(fault, patch, comment));
    }
    return ok(fault);
  }

  /** @param {any} fault @param {Record<string, any>} patch @param {string} [comment] */
  change(fault, patch, comment = "") {
    let said = comment;
    for (const [field, after] of Object.entries(patch)) {
      const before = fault[field] ?? null;
      if (before === after) continue;
      fault[field] = after;
      this.note(fault, { what: field === "assignee_id" ? "assignee" : field, before, after, comment: said });
      said = "";
    }
    if (said) this.note(fault, { what: "comment", before: null, after: null, comment: said });
    return fault;
  }

  /** @param {any} fault @param {any} change */
  note(fault, change) {
    this.changes.set(fault.id, [
      ...(this.changes.get(fault.id) ?? []),
      { fault_id: fault.id, changed_at: iso(0), changed_by: null, comment: "", ...change },
    ]);
    fault.version = (fault.version ?? 1) + 1;
    fault.closed_at = fault.state === "verified" ? iso(0) : null;
    fault.photos = (this.photos.get(fault.id) ?? []).length;
    this.site.publish([{ kind: "fault", fault }]);
  }
}

/** @param {any} photo */
const bare = ({ bytes, ...photo }) => photo;
/** @param {any} value */
const ok = (value) => ({ status: 200, value });
/** @param {number} status @param {string} code @param {string} detail @param {any} [current] */
const problem = (status, code, detail, current) => ({
  status,
  value: { type: "about:blank", title: code, status, code, detail, current },
});
