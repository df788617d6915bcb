// What an inspector has said and the server has not heard yet. Kept in the browser's storage, handed over in
// order when there is a link, each thing exactly once: it carries an id of its own, by which the server knows
// what it has already.

/**
 * @typedef {{id: string, kind: "walk" | "visit" | "take_back" | "fault", at_ms: number, body: Record<string, any>, refused?: string}} Entry
 * @typedef {Pick<typeof import("../api.js"), "createSession" | "addVisit" | "takeVisitBack" | "reportFault">} OutboxApi
 * @typedef {{recall: (key: string) => string | null, remember: (key: string, value: string | null) => void}} Storage
 */

const KEY = "outbox";

export class Outbox {
  /**
   * @param {OutboxApi} api
   * @param {Storage} storage
   * @param {{onChange?: () => void, onSent?: (entry: Entry, answer: any) => void}} [on]
   */
  constructor(api, storage, on = {}) {
    this.api = api;
    this.storage = storage;
    this.on = on;
    this.sending = false;
    /** Whether something was put in while the rest was under way. */
    this.more = false;
  }

  /** All that waits, oldest first; another tab may have added to it. @returns {Entry[]} */
  entries() {
    try {
      const found = JSON.parse(this.storage.recall(KEY) ?? "[]");
      return Array.isArray(found) ? found : [];
    } catch {
      return [];
    }
  }

  /** @param {Entry[]} entries */
  keep(entries) {
    this.storage.remember(KEY, entries.length > 0 ? JSON.stringify(entries) : null);
    this.on.onChange?.();
  }

  /** @param {Entry} entry */
  add(entry) {
    this.keep([...this.entries(), entry]);
    return this.flush();
  }

  /**
   * Takes something out that is not under way.
   * @param {string} id
   * @returns {boolean} whether it was there
   */
  drop(id) {
    const entries = this.entries();
    if (this.underWay === id || !entries.some((entry) => entry.id === id)) return false;
    this.keep(entries.filter((entry) => entry.id !== id));
    return true;
  }

  /** Hands over what waits. Without a link it stays, and a later call goes on. */
  async flush() {
    if (this.sending) {
      this.more = true;
      return;
    }
    this.sending = true;
    try {
      do {
        this.more = false;
        await this.handOver();
      } while (this.more);
    } finally {
      this.sending = false;
    }
  }

  async handOver() {
    for (;;) {
      const entry = this.entries().find((e) => e.refused === undefined);
      if (!entry) return;
      this.underWay = entry.id;
      let answer;
      try {
        answer = await this.send(entry);
      } catch (/** @type {any} */ error) {
        this.underWay = null;
        // No link, a server that is not itself, or nobody signed in: later.
        if (!(error.status >= 400 && error.status < 500) || [401, 408, 429].includes(error.status)) return;
        this.keep(this.entries().map((e) => (e.id === entry.id ? { ...e, refused: String(error.message) } : e)));
        continue;
      }
      this.underWay = null;
      this.keep(this.entries().filter((e) => e.id !== entry.id));
      this.on.onSent?.(entry, answer);
    }
  }

  /** @param {Entry} entry */
  async send({ kind, id, body }) {
    switch (kind) {
      case "walk":
        return this.api.createSession({ id, ...body });
      case "visit": {
        const { session_id, ...visit } = body;
        return this.api.addVisit(session_id, visit);
      }
      case "take_back":
        try {
          return await this.api.takeVisitBack(body.session_id, body.visit_id);
        } catch (/** @type {any} */ error) {
          // It is gone already: what was wanted.
          if (error.status === 404) return null;
          throw error;
        }
      case "fault":
        return this.api.reportFault({ id, ...body });
    }
  }

  /** @type {string | null} */
  underWay = null;
}

/** A UUID, also where the page is not served securely and the browser has no `randomUUID`. */
export function newId() {
  if (typeof crypto.randomUUID === "function") return crypto.randomUUID();
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const hex = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return `${hex.slice(0, 8)}-${hex.slice(8, 12)}-${hex.slice(12, 16)}-${hex.slice(16, 20)}-${hex.slice(20)}`;
}
