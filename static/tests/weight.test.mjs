import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import { test } from "node:test";
import { gzipSync } from "node:zlib";
import { FIRST } from "../js/systems/index.js";

const root = new URL("..", import.meta.url);
const read = (path) => readFile(new URL(path, root));
const list = async (folder) => (await readdir(new URL(folder, root), { recursive: true })).map((n) => `${folder}${n}`);

async function own() {
  const files = [...(await list("js/")), ...(await list("css/"))].filter((n) => /\.(js|css)$/.test(n));
  return ["index.html", "favicon.svg", ...files];
}

/**
 * The modules that come with one, and the screens that come only when they are gone to.
 * @param {string} entry
 */
async function graph(entry) {
  const files = new Set();
  const screens = new Set();
  const waiting = [entry];
  for (let name = waiting.pop(); name; name = waiting.pop()) {
    if (files.has(name)) continue;
    files.add(name);
    const text = String(await read(name));
    const at = (/** @type {string} */ path) => new URL(path, new URL(name ?? "", "file:///")).pathname.slice(1);
    for (const [, path] of text.matchAll(/^(?:import|export)[^;"]*"(\.[^"]+)"/gm)) waiting.push(at(path));
    for (const [, path] of text.matchAll(/=> import\("(\.[^"]+)"\)/g)) screens.add(at(path));
  }
  return { files, screens };
}

/** What the page begins with: its own modules, and those of the system that sessions are of by default. */
async function beginning() {
  const { files, screens } = await graph("js/main.js");
  const system = `js/systems/${FIRST}.js`;
  for (const name of (await graph(system)).files) files.add(name);
  screens.delete(system);
  return { files, screens };
}

test("the page weighs at most 150 kB packed before data, libraries and one language included; no other screen adds more than 50 kB", async (context) => {
  const packed = async (/** @type {Iterable<string>} */ names) => {
    const parts = await Promise.all([...names].map((name) => read(name)));
    return parts.reduce((sum, part) => sum + gzipSync(part).length, 0);
  };
  const vendor = ["vendor/leaflet/leaflet.js", "vendor/leaflet/leaflet.css"];
  if ((await Promise.all(vendor.map((name) => read(name).catch(() => null)))).includes(null))
    return context.skip("run `npm run vendor` first");
  const first = await beginning();
  const styles = (await own()).filter((name) => !name.endsWith(".js"));
  const words = ["messages/zh-CN.json", `messages/${FIRST}.zh-CN.json`];
  const base = await packed([...first.files, ...styles, ...words, ...vendor]);
  let heaviest = 0;
  for (const screen of first.screens) {
    const more = [...(await graph(screen)).files].filter((name) => !first.files.has(name));
    const bytes = await packed(more);
    heaviest = Math.max(heaviest, bytes);
    context.diagnostic(`${screen}: ${(bytes / 1000).toFixed(1)} kB more`);
  }
  context.diagnostic(`${(base / 1000).toFixed(1)} kB packed for the live screen`);
  assert.ok(first.files.size > 30 && first.screens.size > 3, "the modules are found");
  assert.ok(base <= 150_000, `${base} bytes`);
  assert.ok(heaviest <= 50_000, `${heaviest} bytes`);
});

test("the page asks at once for every module that it begins with, and for no other", async () => {
  const { files } = await beginning();
  const asked = [...String(await read("index.html")).matchAll(/<link rel="modulepreload" href="\/([^"]+)">/g)].map(
    (m) => m[1],
  );
  assert.deepEqual(asked.sort(), [...files].filter((name) => name !== "js/main.js").sort());
});

test("nothing inline and nothing from elsewhere: the page keeps to a policy of default-src 'self'", async () => {
  const index = String(await read("index.html"));
  assert.doesNotMatch(index, /<style|\sstyle=|\son\w+=|<script(?![^>]*\ssrc=)/);
  for (const name of await own()) {
    const text = String(await read(name));
    const hosts = [...text.matchAll(/https?:\/\/[^\s"'`)]+/g)]
      .map((m) => m[0])
      .filter((u) => u !== "http://www.w3.org/2000/svg");
    assert.deepEqual(hosts, [], name);
    if (name.endsWith(".js")) assert.doesNotMatch(text, /\sstyle="|\beval\(|new Function/, name);
  }
});

test("the lock file names no registry and no path of a machine", async () => {
  const lock = String(await read("package-lock.json"));
  assert.doesNotMatch(lock, /"resolved"|https?:\/\/(?!(?:www\.)?(?:github|opencollective)\b)[^"]*registry|file:\//);
});
