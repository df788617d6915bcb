// What the description of the API says, as a person reads it: a JSON schema by names, kinds, what each is; answers, by what
// is given and by the codes of problems.

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

/**
 * What is given when all is well: the body of the first such answer that has one.
 * @param {Record<string, any>} responses
 * @returns {Record<string, {schema: any}> | undefined}
 */
export const givesOf = (responses) =>
  Object.entries(responses).find(([status, { content }]) => status < "300" && content)?.[1].content;

/**
 * The problems that may be answered, a line a status: `404 marker_not_found`.
 * @param {Record<string, any>} responses
 * @param {any} document the OpenAPI document, for what a reference names
 * @returns {string[]}
 */
export function refusesOf(responses, document) {
  return Object.entries(responses).flatMap(([status, answer]) => {
    const shared = document.components?.responses?.[answer.$ref?.split("/").at(-1)];
    const schema = (shared ?? answer).content?.["application/problem+json"]?.schema;
    const codes = (schema?.allOf ?? []).flatMap((/** @type {any} */ part) => part.properties?.code?.enum ?? []);
    return codes.length > 0 ? [`${status} ${codes.join(", ")}`] : [];
  });
}
