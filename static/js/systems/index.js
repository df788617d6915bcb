// The systems of the page. A system decides how the streams of a carrier's sensors become a track; what differs from one to
// the next on the screens comes from the object that it hands to the page, and no other file names a system's own things.
//
// A session names its system (`session.system`; one of a server from before systems names none and is the pedestrian's).
// A screen asks `systemOf(session)` for the object and `word(system, key)` for words: the system's own
// (messages/NAME.en.json, every key beginning with the name) before the page's before those of the server's declaration.
//
// A new system is a file beside this one that exports `refined`, a line in WHEN_OPENED, and its two message files; they are
// fetched when a session of it is opened. One without a file is shown by what the server declares of it (`generic.js`).

import { addWords, has, t } from "../i18n.js";
import { generic } from "./generic.js";

/** @typedef {import("./system.js").UploadSlot} UploadSlot */
/** @typedef {import("./system.js").Readout} Readout */
/** @typedef {import("./system.js").System} System `system.js` says what is what */

/** Systems with a file of their own. @type {Record<string, () => Promise<{system: System}>>} */
const FILES = {
  pedestrian: () => import("./pedestrian.js"),
};

/** What the page has beside the declaration of a system, once a session of it is opened. @type {Record<string, () => Promise<{refined: (declared: System) => System}>>} */
const WHEN_OPENED = {
  pole: () => import("./pole.js"),
  cabin: () => import("./cabin.js"),
  rover: () => import("./rover.js"),
};

/** What a session is of that names no system. */
export const FIRST = "pedestrian";

/** @type {Map<string, System>} */
const loaded = new Map();
/** What the server declares, in its order. @type {import("./generic.js").Declaration[]} */
let declared = [];
/** @type {Promise<boolean> | null} */
let asked = null;

/**
 * The file and the words of a system; nothing where it has none.
 * @param {string} name
 */
export async function loadSystem(name) {
  if (loaded.has(name) || !Object.hasOwn(FILES, name)) return;
  const [{ system }] = await Promise.all([FILES[name](), addWords(name)]);
  loaded.set(name, system);
}

/** @type {Set<string>} */
const opened = new Set();

/**
 * A session of this system is opened: its file and its words, where it has some that nobody needs before.
 * @param {string} [name]
 */
export async function openSystem(name = FIRST) {
  const one = loaded.get(name);
  if (!one || opened.has(name) || !Object.hasOwn(WHEN_OPENED, name)) return;
  const [{ refined }] = await Promise.all([WHEN_OPENED[name](), addWords(name)]);
  if (opened.has(name)) return;
  opened.add(name);
  loaded.set(name, refined(one));
}

/**
 * Fetches what the server declares, once, and what the page has for each.
 * @param {Pick<typeof import("../api.js"), "systems">} api
 * @returns {Promise<boolean>} whether it is known now
 */
export function learnSystems(api) {
  asked ??= api
    .systems()
    .then(async ({ systems }) => {
      await Promise.all(systems.map(({ name }) => loadSystem(name)));
      for (const one of systems) if (!loaded.has(one.name)) loaded.set(one.name, generic(one));
      declared = systems;
      return true;
    })
    .catch(() => {
      // Asked again when it is needed again.
      asked = null;
      return false;
    });
  return asked;
}

/** Names of the systems that a session can be begun of. */
export const systemNames = () => (declared.length > 0 ? declared.map(({ name }) => name) : [FIRST]);

/** @param {string} [name] none: the first */
export function systemNamed(name = FIRST) {
  return loaded.get(name) ?? undeclared(name);
}

/** @param {{system?: string | null} | null | undefined} row a session, or what belongs to one */
export const systemOf = (row) => systemNamed(row?.system ?? FIRST);

/** Whether nothing is known of the system of a session yet. @param {{system?: string | null}} row */
export const isUnknown = ({ system }) => Boolean(system) && !loaded.has(system ?? FIRST);

/** Those that nothing is known of, yet: their carriers are on the map all the same. @type {Map<string, System>} */
const unknown = new Map();

/** @param {string} name */
function undeclared(name) {
  const nothing = {
    title: name,
    carrier_kind: "",
    streams: [],
    instrument: null,
    parts: [],
    aids: [],
    charts: [],
    anomalies: [],
  };
  const made = unknown.get(name) ?? generic({ name, ...nothing });
  unknown.set(name, made);
  return made;
}

/**
 * The key of the system's own message, else the general one.
 * @param {System | null} system null: the general one
 * @param {string} key
 */
export function keyOf(system, key) {
  const own = system && `${system.name}.${key}`;
  return own && has(own) ? own : key;
}

/**
 * The words of a key as this system has them; else the last part of the key, which is the server's own word.
 * @param {System} system
 * @param {string} key
 * @param {Record<string, string | number>} [values]
 */
export function word(system, key, values) {
  const found = keyOf(system, key);
  return has(found) ? t(found, values) : (system.words[key] ?? key.slice(key.lastIndexOf(".") + 1));
}

/**
 * What an anomaly of this kind means and what to do; nothing where nobody says.
 * @param {System} system
 * @param {string} kind
 */
export function aboutAnomaly(system, kind) {
  const key = `anomaly.about.${kind}`;
  const found = keyOf(system, key);
  return has(found) ? t(found) : (system.words[key] ?? "");
}

/** A stream as it is shown. @param {System} system @param {string} stream */
export const streamName = (system, stream) => word(system, `stream.${stream}`);

/** The stream of a row of the server as it is shown; null where it is of none. @param {System} system @param {any} row */
export function streamOf(system, row) {
  const stream = system.streamOf(row);
  return stream && streamName(system, stream);
}
