import assert from "node:assert/strict";
import { test } from "node:test";
import { shapeLines } from "../js/reference/shape.js";

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
