import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import { test } from "node:test";
import { pickLanguage, setLanguage, t } from "../js/i18n.js";
import { duration, elapsed, heading, length, number } from "../js/format.js";
import { html } from "../js/html.js";

const root = new URL("..", import.meta.url);
const read = (path) => readFile(new URL(path, root), "utf8");
/** What systems, and screens that are seldom opened, alone have to say is in files of their own. */
const systems = (await readdir(new URL("messages/", root))).flatMap((n) => /^(\w+)\.en\.json$/.exec(n)?.[1] ?? []);
const words = async (/** @type {string} */ file) => JSON.parse(await read(`messages/${file}.json`));
const en = await words("en");
const zh = await words("zh-CN");
for (const system of systems) {
  Object.assign(en, await words(`${system}.en`));
  Object.assign(zh, await words(`${system}.zh-CN`));
}

async function sources() {
  const names = (await readdir(new URL("js/", root), { recursive: true })).filter((n) => n.endsWith(".js"));
  return [...(await Promise.all(names.map((n) => read(`js/${n}`)))), await read("index.html")];
}

test("the keys of a system or a screen with a file of its own begin with its name, and no other does", async () => {
  assert.deepEqual(systems, [
    "admin",
    "cabin",
    "help",
    "lab",
    "markers",
    "past",
    "pedestrian",
    "pole",
    "reference",
    "rover",
    "sessions",
    "tokens",
    "upload",
  ]);
  for (const file of [...systems.flatMap((s) => [`${s}.en`, `${s}.zh-CN`]), "en", "zh-CN"])
    for (const key of Object.keys(await words(file)))
      assert.equal(
        systems.find((system) => key.startsWith(`${system}.`)),
        systems.find((system) => file.startsWith(`${system}.`)),
        `${file}: ${key}`,
      );
});

test("both languages have the same keys", () => {
  assert.deepEqual(
    Object.keys(en).filter((k) => !(k in zh)),
    [],
    "missing in zh-CN",
  );
  assert.deepEqual(
    Object.keys(zh).filter((k) => !(k in en)),
    [],
    "missing in en",
  );
});

test("a message has the same places to fill in in both languages, and says something", () => {
  const places = (text) => [...text.matchAll(/\{(\w+)\}/g)].map((m) => m[1]).sort();
  for (const key of Object.keys(en)) {
    assert.deepEqual(places(zh[key]), places(en[key]), key);
    assert.ok(en[key].trim() && zh[key].trim(), key);
  }
});

test("every key that the page names is there, and every key that is there is used", async () => {
  const text = (await sources()).join("\n");
  // What is asked for by a system's own word may be there with its name before it.
  const keys = Object.keys(en);
  const plain = (/** @type {string} */ key) =>
    key.slice((systems.find((system) => key.startsWith(`${system}.`)) ?? "").length).replace(/^\./, "");
  const named = new Set([...text.matchAll(/(?:\bt\(|data-t(?:-label|-hint)?=)"([a-z_.0-9]+)"/g)].map((m) => m[1]));
  for (const key of named) assert.ok(key in en, `${key} is used and has no message`);
  // Keys that are put together: `presence.${…}`.
  const built = [...text.matchAll(/`([a-z_.]+\.)\$\{/g)].map((m) => m[1]);
  const quoted = new Set([...text.matchAll(/"([a-z_]+(?:\.[a-z_0-9]+)*)"/g)].map((m) => m[1]));
  // The singular of a key that counts.
  const plural = (key) => key.replace(/\.one$/, "");
  const used = (key) => named.has(key) || quoted.has(key) || built.some((b) => key.startsWith(b));
  assert.deepEqual(
    keys.map(plural).filter((key) => !used(key) && !used(plain(key))),
    [],
  );
  for (const start of built)
    assert.ok(
      keys.some((k) => k.startsWith(start) || plain(k).startsWith(start)),
      `nothing begins with ${start}`,
    );
});

test("what every system is asked for has words without a system", async () => {
  // The words of a screen are there when the screen asks.
  const general = {};
  for (const file of ["en", "upload.en", "reference.en", "sessions.en"]) Object.assign(general, await words(file));
  const asked = [...(await sources()).join("\n").matchAll(/\b(?:word|keyOf)\(\s*system,\s*"([a-z_.0-9]+)"/g)].map(
    (m) => m[1],
  );
  assert.ok(asked.length > 5, `${asked}`);
  for (const key of asked) assert.ok(key in general, `${key} has no general message`);
});

test("one thing is told in the singular where the language has one", () => {
  setLanguage("en", { walks: "{n} walks", "walks.one": "{n} walk", chosen: "{n} chosen" });
  assert.deepEqual(
    [0, 1, 2].map((n) => t("walks", { n })),
    ["0 walks", "1 walk", "2 walks"],
  );
  assert.equal(t("chosen", { n: 1 }), "1 chosen");
});

test("the language is the chosen one, else the browser's first that is spoken here", () => {
  assert.equal(pickLanguage(["de-DE", "zh-TW", "en"], null), "zh-CN");
  assert.equal(pickLanguage(["en-GB"], null), "en");
  assert.equal(pickLanguage(["fr"], null), "en");
  assert.equal(pickLanguage(["en"], "zh-CN"), "zh-CN");
  assert.equal(pickLanguage(["en"], "xx"), "en");
});

test("what is filled into a template is text, whatever it contains", () => {
  const name = `<img src=x onerror="alert('1')">&`;
  assert.equal(html`<b title="${name}">${name}</b>`.text, `<b title="${escape5(name)}">${escape5(name)}</b>`);
  assert.equal(html`${[html`<i>${"<"}</i>`, null, false, 0]}`.text, "<i>&lt;</i>0");
  function escape5(s) {
    return s
      .replaceAll("&", "&amp;")
      .replaceAll("<", "&lt;")
      .replaceAll(">", "&gt;")
      .replaceAll('"', "&quot;")
      .replaceAll("'", "&#39;");
  }
});

test("figures read well", () => {
  setLanguage("en", en);
  assert.equal(length(3.14159), "3.1 m");
  assert.equal(length(145.2), "145 m");
  assert.equal(length(12345), "12.3 km");
  assert.equal(length(null), "–");
  assert.equal(number(-0.04, 1), "0.0");
  assert.equal(number(-2.5, 1), "−2.5");
  assert.equal(duration(185), "3 min 05 s");
  assert.equal(duration(3900), "1 h 05 min");
  assert.equal(elapsed(3725), "1:02:05");
  assert.equal(heading(-Math.PI / 2), "270°");
  assert.equal(heading(2 * Math.PI - 0.001), "000°");
  assert.equal(t("no.such.key"), "no.such.key");
});
