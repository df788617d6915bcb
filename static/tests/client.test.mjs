import assert from "node:assert/strict";
import { test } from "node:test";
import { clientOf } from "../scripts/client.mjs";

const walk = { $ref: "#/components/schemas/Walk" };
const refused = {
  content: {
    "application/problem+json": { schema: { allOf: [{}, { properties: { code: { enum: ["b_b", "a_a"] } } }] } },
  },
};
const document = {
  paths: {
    "/walks/{id}": {
      get: {
        operationId: "get_walk",
        summary: "One walk",
        parameters: [
          { name: "id", in: "path", required: true, schema: { type: "string" } },
          {
            name: "rate_hz",
            in: "query",
            required: false,
            schema: { type: ["number", "null"] },
            description: "How often",
          },
        ],
        responses: {
          200: { content: { "application/json": { schema: walk } } },
          404: { $ref: "#/components/responses/404" },
        },
      },
      put: {
        operationId: "put_walk",
        summary: "Keeps a walk",
        parameters: [{ name: "id", in: "path", required: true, schema: { type: "string" } }],
        requestBody: { content: { "application/json": { schema: walk }, "text/csv": { schema: { type: "string" } } } },
        responses: { 204: {} },
      },
    },
    "/feed": { get: { operationId: "open_feed", summary: "A websocket", responses: { 101: {} } } },
  },
  components: {
    responses: { 404: refused },
    schemas: {
      Walk: {
        type: "object",
        description: "A walk.",
        required: ["id"],
        properties: {
          id: { type: "string", format: "uuid" },
          "start-m": { type: "array", prefixItems: [{ type: "number" }, { type: "number" }] },
          state: { anyOf: [{ const: "live" }, { enum: ["done"] }, { type: "null" }] },
          figures: { type: "object", additionalProperties: { type: "number" } },
        },
      },
    },
  },
};

/** The client, asked without a network: what it sends, and what is answered to that. */
async function asked(/** @type {(api: any) => Promise<any>} */ ask, /** @type {Response} */ answer) {
  const { client, Refused } = await import(
    `data:text/javascript,${encodeURIComponent(clientOf(document)["client.mjs"])}`
  );
  const real = globalThis.fetch;
  /** @type {any[]} */
  const sent = [];
  globalThis.fetch = async (...given) => (sent.push(given), answer);
  try {
    return {
      sent,
      Refused,
      got: await ask(client("http://here", { headers: { Authorization: "Bearer t" } })).catch((e) => e),
    };
  } finally {
    globalThis.fetch = real;
  }
}

const json = (/** @type {unknown} */ body, status = 200, kind = "application/json") =>
  new Response(JSON.stringify(body), { status, headers: { "Content-Type": kind } });

test("every operation but a websocket has a function with its types", () => {
  const types = clientOf(document)["client.d.mts"];
  for (const line of [
    'get_walk: "a_a" | "b_b";',
    "put_walk: never;",
    "/** How often */",
    "rate_hz?: number | null;",
    "}): Promise<Answer<200, Walk>>;",
    '({ type?: "application/json"; body: Walk } | { type: "text/csv"; body: string })',
    "Promise<Answer<204, undefined>>;",
    '"start-m"?: [number, number];',
    'state?: ("live" | "done" | null);',
    "figures?: Record<string, number>;",
    "  id: string;",
  ])
    assert.ok(types.includes(line), `${line} is missing in\n${types}`);
  assert.ok(!types.includes("open_feed"));
});

test("what is given goes into path, query, headers and body", async () => {
  const { sent, got } = await asked((api) => api.get_walk({ id: "a/b", rate_hz: 2 }), json({ id: "a/b" }));
  assert.equal(sent[0][0], "http://here/walks/a%2Fb?rate_hz=2");
  assert.deepEqual(sent[0][1], { method: "GET", headers: { Authorization: "Bearer t" }, body: undefined });
  assert.deepEqual([got.status, got.body], [200, { id: "a/b" }]);
  const put = await asked(
    (api) => api.put_walk({ id: "a", type: "text/csv", body: "x,y" }),
    new Response(null, { status: 204 }),
  );
  assert.equal(put.sent[0][1].headers["Content-Type"], "text/csv");
  assert.equal(put.sent[0][1].body, "x,y");
  assert.equal(put.got.body, undefined);
});

test("a refusal has its code, and an answer that is not described is none", async () => {
  const problem = { status: 404, code: "a_a", detail: "there is none" };
  const { got, Refused } = await asked(
    (api) => api.get_walk({ id: "a" }),
    json(problem, 404, "application/problem+json"),
  );
  assert.ok(got instanceof Refused && got.code === "a_a", String(got));
  const other = await asked((api) => api.get_walk({ id: "a" }), json({}, 202));
  assert.match(String(other.got), /no answer 202 application\/json is described/);
});
