import assert from "node:assert/strict";
import { test } from "node:test";
import { givesOf, refusesOf, shapeLines } from "../js/reference/shape.js";

const document = {
  components: {
    schemas: {
      Walk: {
        type: "object",
        required: ["id"],
        properties: {
          id: { type: "string", format: "uuid" },
          feet: { type: "array", items: { type: "string" }, description: "Which feet" },
          start: { anyOf: [{ $ref: "#/components/schemas/Start" }, { type: "null" }] },
        },
      },
      Start: { type: "object", properties: { up_m: { type: ["number", "null"], format: "double" } } },
      Again: { type: "object", properties: { again: { $ref: "#/components/schemas/Again" } } },
    },
  },
};

test("a shape is read as names, kinds and what they are", () => {
  assert.deepEqual(shapeLines({ $ref: "#/components/schemas/Walk" }, document), [
    "{",
    "  id: string (uuid)",
    "  feet?: list of string   Which feet",
    "  start?: {",
    "    up_m?: number | null (double)",
    "  }",
    "  or",
    "  null",
    "}",
  ]);
  assert.deepEqual(shapeLines({ type: "array", items: { enum: ["a", "b"] } }, document), ['list of "a" | "b"']);
  assert.deepEqual(shapeLines(true, document), ["anything"]);
});

test("a shape within itself comes to an end", () => {
  assert.ok(shapeLines({ $ref: "#/components/schemas/Again" }, document).length < 20);
});

test("answers are read as what is given and the codes of problems", () => {
  const problem = (/** @type {string[]} */ codes) => ({
    content: { "application/problem+json": { schema: { allOf: [{}, { properties: { code: { enum: codes } } }] } } },
  });
  const responses = {
    200: { content: { "application/json": { schema: true } } },
    401: { $ref: "#/components/responses/401" },
    404: problem(["walk_not_found", "not_an_id"]),
  };
  assert.deepEqual(givesOf(responses), responses[200].content);
  assert.equal(givesOf({ 204: {}, 404: problem(["a"]) }), undefined);
  assert.deepEqual(refusesOf(responses, { components: { responses: { 401: problem(["not_signed_in"]) } } }), [
    "401 not_signed_in",
    "404 walk_not_found, not_an_id",
  ]);
});
