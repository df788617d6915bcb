// Webhooks of the mock: registered, tried out, switched on and off. A receiver named `down` never answers.

import { iso } from "./site.mjs";

export class MockWebhooks {
  constructor() {
    /** @type {any[]} */
    this.hooks = [];
    /** @type {any[]} */
    this.sent = [];
  }

  /**
   * @param {string} method
   * @param {(string | undefined)[]} path after `webhooks`
   * @param {any} given
   * @returns {{status: number, value?: unknown} | null}
   */
  answer(method, [id, verb], given) {
    const hook = this.hooks.find((h) => h.id === id);
    if (id && !hook)
      return {
        status: 404,
        value: {
          type: "about:blank",
          title: "webhook_not_found",
          status: 404,
          code: "webhook_not_found",
          detail: `there is no webhook ${id}`,
        },
      };
    switch (`${method}${id ? " :id" : ""}${verb ? `/${verb}` : ""}`) {
      case "GET":
        return { status: 200, value: this.hooks };
      case "POST": {
        const made = {
          id: `w${this.hooks.length + 1}`,
          enabled: true,
          disabled_why: null,
          failing_since: null,
          version: 1,
          created_at: iso(0),
          created_by: null,
          updated_at: iso(0),
          ...given,
        };
        this.hooks.push(made);
        return { status: 201, value: { ...made, secret: "5ec4e7".repeat(10) } };
      }
      case "PATCH :id":
        return { status: 200, value: Object.assign(hook, given, { version: hook.version + 1 }) };
      case "DELETE :id":
        this.hooks = this.hooks.filter((h) => h.id !== id);
        return { status: 204 };
      case "POST :id/secret":
        return { status: 200, value: { ...hook, secret: "0the75".repeat(10) } };
      case "POST :id/test": {
        const down = hook.name === "down";
        const delivery = {
          id: this.sent.length + 1,
          webhook_id: id,
          event_id: "e1",
          event: "test",
          body: '{"event":"test"}',
          state: "waiting",
          tries: 0,
          next_at: iso(0),
          tried_at: null,
          took_ms: null,
          status: null,
          answer: null,
          created_at: iso(0),
        };
        this.sent.unshift(delivery);
        setTimeout(() => {
          Object.assign(
            delivery,
            { tries: 1, tried_at: iso(0), took_ms: 12 },
            down
              ? { answer: "connection refused", next_at: iso(10_000) }
              : { state: "delivered", next_at: null, status: 204, answer: "" },
          );
          if (down) hook.failing_since = iso(0);
        }, 200);
        return { status: 202, value: delivery };
      }
      case "GET :id/deliveries":
        return { status: 200, value: this.sent.filter((d) => d.webhook_id === id) };
      default:
        return null;
    }
  }
}
