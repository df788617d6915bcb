// Writes a client of the API, made from its description: client.mjs, and client.d.mts with its types.
// node static/scripts/client.mjs http://127.0.0.1:8080/api/v1/openapi.json FOLDER; a file with the description will do, too.

import { mkdir, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const METHODS = ["get", "post", "put", "patch", "delete"];
const PROBLEM = "application/problem+json";

/** @typedef {{id: string, method: string, path: string, about: string, parameters: any[], takes: Record<string, any>, gives: Record<string, Record<string, any>>, codes: string[]}} Operation */

/**
 * The files of a client, by their names.
 * @param {any} document the OpenAPI document
 */
export function clientOf(document) {
  const operations = operationsOf(document);
  return {
    "client.mjs": `${HEAD}\nconst OPERATIONS = {\n${operations.map(entryOf).join("")}};\n${runtime()}`,
    "client.d.mts": `${HEAD}\n${types(operations)}\n${shapes(document)}`,
  };
}

/**
 * What can be asked by fetch: all but the websockets.
 * @param {any} document
 * @returns {Operation[]}
 */
function operationsOf(document) {
  return Object.entries(document.paths).flatMap(([path, item]) =>
    METHODS.filter((method) => item[method] && !item[method].responses["101"]).map((method) => {
      const { operationId, summary, parameters = [], requestBody, responses } = item[method];
      const answers = Object.entries(responses).map(([status, answer]) => [status, resolved(answer, document)]);
      const done = answers.filter(([status]) => status < "300");
      const problems = answers.map(([, answer]) => answer.content?.[PROBLEM]).filter(Boolean);
      return {
        id: operationId,
        method: method.toUpperCase(),
        path,
        about: summary,
        parameters,
        takes: requestBody?.content ?? {},
        gives: Object.fromEntries(done.map(([status, answer]) => [status, answer.content ?? {}])),
        codes: [...new Set(problems.flatMap(({ schema }) => codesOf(schema)))].sort(),
      };
    }),
  );
}

/** @param {any} answer @param {any} document */
function resolved(answer, document) {
  if (!answer.$ref) return answer;
  return answer.$ref
    .slice(2)
    .split("/")
    .reduce((/** @type {any} */ at, /** @type {string} */ key) => at[key], document);
}

/** @param {any} schema @returns {string[]} the words that a problem's code may be */
const codesOf = (schema) =>
  (schema.allOf ?? [schema]).flatMap((/** @type {any} */ s) => s.properties?.code?.enum ?? []);

/** @param {Operation} operation */
function entryOf({ id, method, path, parameters, takes, gives }) {
  const places = Object.fromEntries(parameters.map((p) => [p.name, p.in]));
  const kinds = Object.fromEntries(Object.entries(gives).map(([status, content]) => [status, Object.keys(content)]));
  return `  ${id}: ${JSON.stringify({ method, path, parameters: places, takes: Object.keys(takes), gives: kinds })},\n`;
}

const HEAD = "// Made from the description of the API by static/scripts/client.mjs.\n";

/** What every client has: the refusal and the asking. It stands here as code, and is written out as text. */
function runtime() {
  return `
/** An answer that says why something was not done. */
export ${Refused}

export ${client}
`;
}

class Refused extends Error {
  /** @param {string} operation @param {any} problem */
  constructor(operation, problem) {
    super(`${operation}: ${problem.status} ${problem.code}: ${problem.detail}`);
    this.operation = operation;
    this.status = problem.status;
    this.code = problem.code;
    this.problem = problem;
  }
}

/** @type {Record<string, any>} stands in the file that is made. */
const OPERATIONS = {};

/** @param {string} origin @param {{headers?: Record<string, string>}} [options] */
function client(origin, { headers = {} } = {}) {
  return Object.fromEntries(Object.keys(OPERATIONS).map((name) => [name, (given = {}) => ask(name, given)]));

  /** @param {string} name @param {any} given */
  async function ask(name, given) {
    const { method, path, parameters, takes, gives } = OPERATIONS[name];
    const query = new URLSearchParams();
    const sent = { ...headers };
    let at = path;
    for (const [parameter, place] of Object.entries(parameters)) {
      const value = given[parameter];
      if (place === "path") at = at.replace(`{${parameter}}`, encodeURIComponent(value));
      else if (value === undefined || value === null) continue;
      else if (place === "query") query.set(parameter, value);
      else sent[parameter] = String(value);
    }
    let body;
    if (takes.length > 0) {
      const kind = given.type ?? takes[0];
      sent["Content-Type"] = kind.includes("*") ? "application/octet-stream" : kind;
      body = kind === "application/json" ? JSON.stringify(given.body) : given.body;
    }
    const response = await fetch(origin + at + (query.size > 0 ? `?${query}` : ""), { method, headers: sent, body });
    const kind = (response.headers.get("Content-Type") ?? "").split(";")[0];
    const bytes = new Uint8Array(await response.arrayBuffer());
    const text = () => new TextDecoder().decode(bytes);
    const read = kind.endsWith("json") ? JSON.parse(text()) : kind.startsWith("text/") ? text() : bytes;
    if (!response.ok && kind === "application/problem+json") throw new Refused(name, read);
    const kinds = gives[response.status];
    if (!kinds || (kinds.length > 0 && !kinds.includes(kind)))
      throw new Error(`${name}: no answer ${response.status} ${kind} is described`);
    return { status: response.status, headers: response.headers, body: kinds.length > 0 ? read : undefined };
  }
}

/** @param {Operation[]} operations */
function types(operations) {
  const codes = operations.map(({ id, codes }) => `  ${id}: ${codes.map(quoted).join(" | ") || "never"};\n`);
  return `/** What was answered. */
export interface Answer<Status extends number, Body> {
  status: Status;
  headers: Headers;
  body: Body;
}

/** The codes of problems that each operation may answer. */
export interface Problems {
${codes.join("")}}

/** An answer that says why something was not done. */
export class Refused extends Error {
  operation: keyof Problems;
  status: number;
  code: Problems[keyof Problems];
  problem: Problem;
}

export interface Options {
  /** Sent with every request, such as \`Authorization\`. */
  headers?: Record<string, string>;
}

/** @param origin such as \`http://127.0.0.1:8080\` */
export function client(origin: string, options?: Options): Client;

export interface Client {
${operations.map(methodOf).join("")}}
`;
}

/** @param {Operation} operation */
function methodOf({ id, about, parameters, takes, gives }) {
  const given = [
    ...parameters.map(
      (p) => `${comment(p.description, "    ")}    ${named(p.name)}${p.required ? "" : "?"}: ${typeOf(p.schema)};\n`,
    ),
  ];
  const bodies = Object.entries(takes).map(([kind, { schema }], k) => {
    const type = Object.keys(takes).length > 1 ? `type${k === 0 ? "?" : ""}: ${quoted(kind)}; ` : "";
    return `{ ${type}body: ${bodyOf(kind, schema, "Uint8Array<ArrayBuffer>")} }`;
  });
  const isNeeded = bodies.length > 0 || parameters.some((p) => p.required);
  const fields = given.length > 0 ? [`{\n${given.join("")}  }`] : [];
  const all = [...fields, ...(bodies.length > 0 ? [bodies.length > 1 ? `(${bodies.join(" | ")})` : bodies[0]] : [])];
  const takesText = all.length > 0 ? `given${isNeeded ? "" : "?"}: ${all.join(" & ")}` : "";
  const answers = Object.entries(gives).map(([status, content]) => {
    const kinds = Object.entries(content).map(([kind, { schema }]) => bodyOf(kind, schema, "Uint8Array"));
    return `Answer<${status}, ${[...new Set(kinds)].join(" | ") || "undefined"}>`;
  });
  return `${comment(about, "  ")}  ${id}(${takesText}): Promise<${answers.join(" | ")}>;\n`;
}

/** @param {string} kind @param {any} schema @param {string} bytes */
function bodyOf(kind, schema, bytes) {
  if (kind.endsWith("json")) return typeOf(schema);
  return kind.startsWith("text/") ? "string" : bytes;
}

/** @param {any} document */
function shapes(document) {
  return Object.entries(document.components.schemas)
    .map(([name, schema]) => `${comment(schema.description, "")}export type ${name} = ${typeOf(schema)};\n`)
    .join("\n");
}

/**
 * A schema as a type of TypeScript.
 * @param {any} schema
 * @returns {string}
 */
function typeOf(schema) {
  if (schema === true || schema === undefined) return "unknown";
  if (schema.$ref) return schema.$ref.split("/").at(-1);
  if (schema.const !== undefined) return JSON.stringify(schema.const);
  if (schema.enum) return schema.enum.map((/** @type {any} */ word) => JSON.stringify(word)).join(" | ");
  const parts = [];
  const choices = schema.anyOf ?? schema.oneOf;
  if (choices) parts.push(`(${[...new Set(choices.map(typeOf))].join(" | ")})`);
  if (schema.allOf) parts.push(...schema.allOf.map(typeOf));
  if (schema.properties || !choices) {
    const kinds = [schema.type ?? []].flat();
    const own = kinds.map((kind) => kindOf(kind, schema)).join(" | ");
    if (own) parts.push(kinds.length > 1 && parts.length > 0 ? `(${own})` : own);
  }
  return parts.join(" & ") || "unknown";
}

/** @param {string} kind @param {any} schema */
function kindOf(kind, schema) {
  switch (kind) {
    case "integer":
      return "number";
    case "array":
      return schema.prefixItems ? `[${schema.prefixItems.map(typeOf).join(", ")}]` : `Array<${typeOf(schema.items)}>`;
    case "object":
      return objectOf(schema);
    default:
      return kind;
  }
}

/** @param {any} schema */
function objectOf({ properties = {}, required = [], additionalProperties }) {
  const fields = Object.entries(properties).map(
    ([name, schema]) =>
      `${comment(schema.description, "  ")}  ${named(name)}${required.includes(name) ? "" : "?"}: ${typeOf(schema)};\n`,
  );
  if (fields.length > 0) return `{\n${fields.join("")}}`;
  return `Record<string, ${additionalProperties === false ? "never" : typeOf(additionalProperties)}>`;
}

/** @param {string} word */
const quoted = (word) => JSON.stringify(word);
/** @param {string} name as a property */
const named = (name) => (/^[A-Za-z_]\w*$/.test(name) ? name : quoted(name));
/** @param {string | undefined} text @param {string} indent */
const comment = (text, indent) =>
  text ? `${indent}/** ${text.replaceAll("*/", "* /").split("\n").join(`\n${indent} * `)} */\n` : "";

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [from, folder] = process.argv.slice(2);
  if (!from || !folder) {
    console.error("expected the address or file of the description and a folder: node client.mjs openapi.json FOLDER");
    process.exit(2);
  }
  const text = from.startsWith("http") ? await (await fetch(from)).text() : await readFile(from, "utf8");
  await mkdir(folder, { recursive: true });
  for (const [name, content] of Object.entries(clientOf(JSON.parse(text))))
    await writeFile(join(folder, name), content);
}
