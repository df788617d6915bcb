// A JSON schema as a person reads it: names, kinds, what each is.

/** Shapes within shapes deeper than this are named, not spelt out. */
const DEEPEST = 3;

/**
 * @param {any} schema
 * @param {any} document the OpenAPI document, for what a reference names
 * @param {number} [depth]
 * @returns {string[]}
 */
export function shapeLines(schema, document, depth = 0) {
  if (schema === true || schema === undefined) return ["anything"];
  if (schema.$ref) {
    const name = schema.$ref.split("/").at(-1);
    return depth >= DEEPEST ? [name] : shapeLines(document.components?.schemas?.[name] ?? {}, document, depth);
  }
  const choices = schema.anyOf ?? schema.oneOf;
  if (choices) {
    const [first, ...others] = choices.map((/** @type {any} */ one) => shapeLines(one, document, depth));
    if ([first, ...others].every((lines) => lines.length === 1))
      return [[first, ...others].map((lines) => lines[0]).join(" | ")];
    return [first, ...others].flatMap((lines, i) => (i === 0 ? lines : ["or", ...lines]));
  }
  if (schema.enum) return [schema.enum.map((/** @type {any} */ word) => JSON.stringify(word)).join(" | ")];
  if (schema.const !== undefined) return [JSON.stringify(schema.const)];
  const kind = Array.isArray(schema.type) ? schema.type.join(" | ") : schema.type;
  if (schema.properties) {
    const lines = Object.entries(schema.properties).flatMap(([name, property]) => {
      const needed = schema.required?.includes(name) ? "" : "?";
      const [first, ...rest] = shapeLines(property, document, depth + 1);
      const words =
        property.description ?? document.components?.schemas?.[property.$ref?.split("/").at(-1)]?.description;
      return [
        `  ${name}${needed}: ${first}${words && rest.length === 0 ? `   ${words.split("\n")[0]}` : ""}`,
        ...rest.map((line) => `  ${line}`),
      ];
    });
    return ["{", ...lines, "}"];
  }
  if (kind?.includes("array")) {
    const of = shapeLines(schema.items ?? schema.prefixItems?.[0], document, depth);
    return of.length === 1 ? [`list of ${of[0]}`] : [`list of ${of[0]}`, ...of.slice(1)];
  }
  return [schema.format ? `${kind} (${schema.format})` : (kind ?? "anything")];
}
