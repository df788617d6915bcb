import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import { test } from "node:test";
import { gzipSync } from "node:zlib";

const root = new URL("..", import.meta.url);
const read = (path) => readFile(new URL(path, root));
const list = async (folder) => (await readdir(new URL(folder, root), { recursive: true })).map((n) => `${folder}${n}`);

async function own() {
  const files = [...(await list("js/")), ...(await list("css/"))].filter((n) => /\.(js|css)$/.test(n));
  return ["index.html", "favicon.svg", ...files];
}

/** The modules that a browser fetches before the first view: what is imported by name, not what a screen fetches later. */
async function firstModules() {
  const found = new Set(["js/main.js"]);
  for (const name of found) {
    const text = String(await read(name));
    for (const [, from] of text.matchAll(/^(?:import|export)[^;]*? from "(\.[^"]+)";/gm)) {
      found.add(new URL(from, new URL(name, "file:///")).pathname.slice(1));
    }
  }
  return [...found];
}

test("the first view weighs at most 150 kB packed before data, libraries and one language included", async (context) => {
  const vendor = ["vendor/leaflet/leaflet.js", "vendor/leaflet/leaflet.css"];
  const page = ["index.html", "favicon.svg", ...(await list("css/")), ...(await firstModules())];
  const parts = await Promise.all([...page, "messages/zh-CN.json", ...vendor].map((n) => read(n).catch(() => null)));
  if (parts.includes(null)) return context.skip("run `npm run vendor` first");
  const bytes = parts.reduce((sum, part) => sum + gzipSync(/** @type {Buffer} */ (part)).length, 0);
  context.diagnostic(`${(bytes / 1000).toFixed(1)} kB packed in ${page.length + 1} files`);
  assert.ok(page.length > 30, "the modules of the first view are not found");
  assert.ok(bytes <= 150_000, `${bytes} bytes`);
});

test("nothing inline and nothing from elsewhere: the page keeps to a policy of default-src 'self'", async () => {
  const index = String(await read("index.html"));
  assert.doesNotMatch(index, /<style|\sstyle=|\son\w+=|<script(?![^>]*\ssrc=)/);
  for (const name of await own()) {
    const text = String(await read(name));
    const hosts = [...text.matchAll(/https?:\/\/[^\s"'`)]+/g)].map((m) => m[0]).filter((u) => u !== "http://www.w3.org/2000/svg");
    assert.deepEqual(hosts, [], name);
    if (name.endsWith(".js")) assert.doesNotMatch(text, /\sstyle="|\beval\(|new Function/, name);
  }
});

test("the lock file names no registry and no path of a machine", async () => {
  const lock = String(await read("package-lock.json"));
  assert.doesNotMatch(lock, /"resolved"|https?:\/\/(?!(?:www\.)?(?:github|opencollective)\b)[^"]*registry|file:\//);
});
