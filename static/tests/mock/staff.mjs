// Accounts of the mock: who is signed in, tokens, the log of changes. Open until `accounts` is set.

import { iso } from "./site.mjs";

const RIGHTS = ["read", "walk", "walk_for_others", "dispatch", "survey", "engineer", "administer"];
const OF_ROLE = { viewer: ["read"], inspector: ["read", "walk"], admin: RIGHTS };

export class MockStaff {
  constructor() {
    /** Whether there are accounts, so that people have to sign in. */
    this.accounts = /** @type {any[]} */ ([]);
    this.signedIn = /** @type {any} */ (null);
    this.tokens = [
      {
        id: "t1",
        account_id: "a1",
        name: "walk recorder",
        rights: ["walk"],
        inspector_id: "i2",
        created_at: iso(-9e6),
        expires_at: null,
        used_at: iso(-60_000),
        revoked_at: null,
      },
    ];
    this.log = [
      {
        id: 2,
        at: iso(-50_000),
        who: "Chen Wei",
        address: "10.0.0.7",
        action: "inspector.renamed",
        subject: "i2",
        before: { name: "Li Na" },
        after: { name: "李娜" },
      },
      {
        id: 1,
        at: iso(-90_000),
        who: "Chen Wei",
        address: "10.0.0.7",
        action: "account.added",
        subject: "a1",
        before: null,
        after: { name: "Chen Wei", role: "admin" },
      },
    ];
  }

  /** From now on people sign in. */
  close() {
    this.accounts = [
      {
        id: "a1",
        name: "Chen Wei",
        role: "admin",
        inspector_id: null,
        disabled: false,
        expires_at: null,
        created_at: iso(-9e8),
      },
    ];
    this.signedIn = null;
  }

  open() {
    this.accounts = [];
    this.signedIn = null;
  }

  get known() {
    return this.accounts.length === 0 || this.signedIn !== null;
  }

  me() {
    const role = this.signedIn?.role ?? null;
    return {
      has_accounts: this.accounts.length > 0,
      known: this.known,
      id: this.signedIn?.id ?? null,
      name: this.signedIn?.name ?? null,
      role,
      rights: !this.known ? [] : role ? (OF_ROLE[role] ?? ["read"]) : RIGHTS,
      inspector_id: null,
    };
  }

  /**
   * The answer to a route, as [status, body]; null where it is none of these.
   * @param {string} method
   * @param {string[]} parts
   * @param {any} given
   * @returns {[number, any] | null}
   */
  answer(method, [noun, id, part], given) {
    const problem = (/** @type {number} */ status, /** @type {string} */ code, /** @type {string} */ detail) =>
      /** @type {[number, any]} */ ([status, { type: "about:blank", title: code, status, code, detail }]);
    switch (`${method} ${noun}${id ? `/${noun === "account" ? id : ":id"}` : ""}${part ? "/:part" : ""}`) {
      case "GET account":
        return [200, this.me()];
      case "POST account/set-up": {
        if (given.setup_token !== "the setup token")
          return problem(401, "wrong_setup_token", "expected the setup token that the server printed, found another");
        this.close();
        this.accounts[0].name = given.name;
        this.signedIn = this.accounts[0];
        return [201, this.signedIn];
      }
      case "POST account/sign-in":
        if (given.name !== "Chen Wei" || given.password !== "a good sentence")
          return problem(
            401,
            "wrong_name_or_password",
            "expected the name and the password of an account, found at least one of them wrong",
          );
        this.signedIn = this.accounts[0];
        return [200, this.signedIn];
      case "POST account/sign-out":
        this.signedIn = null;
        return [204, null];
      case "POST account/password":
        return given.old === "a good sentence"
          ? [204, null]
          : problem(422, "wrong_password", "expected the password that is in use now, found another");
      case "GET account/sign-ins":
        return [
          200,
          [
            {
              id: "b1",
              address: "10.0.0.7",
              agent: "Mozilla/5.0 (X11; Linux x86_64) Chrome/140",
              created_at: iso(-1e6),
              seen_at: iso(0),
            },
          ],
        ];
      case "DELETE account/sign-ins/:part":
        return [204, null];
      case "GET accounts":
        return [200, this.accounts];
      case "POST accounts": {
        const account = {
          id: `a${this.accounts.length + 1}`,
          inspector_id: null,
          disabled: false,
          expires_at: null,
          created_at: iso(0),
          ...given,
        };
        this.accounts.push(account);
        return [201, account];
      }
      case "PATCH accounts/:id": {
        if (id === "a1" && (given.disabled || given.role))
          return problem(
            409,
            "last_administrator",
            "expected an administrator who can sign in to be left, found none then",
          );
        return [
          200,
          Object.assign(
            this.accounts.find((a) => a.id === id),
            given,
          ),
        ];
      }
      case "DELETE accounts/:id":
        this.accounts = this.accounts.filter((a) => a.id !== id);
        return [204, null];
      case "GET tokens":
        return [200, this.tokens];
      case "POST tokens": {
        const token = {
          id: `t${this.tokens.length + 1}`,
          account_id: "a1",
          inspector_id: null,
          expires_at: null,
          used_at: null,
          revoked_at: null,
          created_at: iso(0),
          ...given,
        };
        this.tokens.unshift(token);
        return [201, { ...token, secret: "5e".repeat(32) }];
      }
      case "DELETE tokens/:id":
        Object.assign(
          this.tokens.find((token) => token.id === id),
          { revoked_at: iso(0) },
        );
        return [204, null];
      case "GET audit":
        return [200, this.log];
      case "GET server":
        return [
          200,
          {
            version: "0.1.0",
            started_at: iso(-8e6),
            database_bytes: 48_300_000,
            free_bytes: 91e9,
            sessions: 12,
            last_backup_at: iso(-7e7),
          },
        ];
      case "POST backups":
        return [201, { file: "lodestep-20261125T081500Z.db", bytes: 48_300_000 }];
      case "GET jobs":
        return [200, []];
      case "GET openapi.json":
        return [
          200,
          {
            paths: {
              "/api/v1/markers/{name}": {
                get: {
                  summary: "One marker",
                  parameters: [{ name: "name", in: "path", required: true, schema: { type: "string" } }],
                  "x-right": "read",
                  responses: {
                    200: { content: { "application/json": { schema: { $ref: "#/components/schemas/Marker" } } } },
                    404: { $ref: "#/components/responses/404" },
                  },
                },
              },
            },
            components: {
              responses: {
                404: {
                  content: {
                    "application/problem+json": {
                      schema: { allOf: [{ properties: { code: { enum: ["marker_not_found"] } } }] },
                    },
                  },
                },
              },
              schemas: {
                Marker: {
                  type: "object",
                  required: ["name"],
                  properties: { name: { type: "string" }, e_m: { type: "number" } },
                },
              },
            },
          },
        ];
      default:
        return null;
    }
  }
}
