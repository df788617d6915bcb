import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { afterEach, test } from "node:test";
import { setLanguage } from "../js/i18n.js";
import { html } from "../js/html.js";
import { system } from "../js/systems/pedestrian.js";
import { figure, sentence } from "../js/sentences.js";

const table = async (/** @type {string} */ name) =>
  JSON.parse(await readFile(new URL(`../messages/${name}.json`, import.meta.url), "utf8"));
const whole = async (/** @type {string} */ name) => ({ ...(await table(name)), ...(await table(`markers.${name}`)) });
const [en, zh] = await Promise.all([whole("en"), whole("zh-CN")]);
const shown = (/** @type {string} */ start, /** @type {any} */ found) => html`${sentence(system, start, found)}`.text;

afterEach(() => setLanguage("en", en));

test("figures have as many decimals as mean something", () => {
  for (const [value, words] of /** @type {[number | string, string][]} */ ([
    [0.01, "0.01"],
    [0.00004, "0"],
    [2.5, "2.5"],
    [2.12345, "2.123"],
    [45.678, "45.68"],
    [1234.56, "1234.6"],
    [-2.5, "−2.5"],
    [0, "0"],
    [100000, "100000"],
    ["gyr_x_rad_s", "gyr_x_rad_s"],
  ]))
    assert.equal(figure(value), words);
});

test("a sentence is made of code and figures in the page's language", () => {
  const gap = {
    detail: "no samples for 2.500 s, where one comes every 0.0100 s",
    figures: { usual_interval_s: 0.01, silence_s: 2.5 },
  };
  setLanguage("en", en);
  assert.equal(shown("anomaly.told.gap", gap), "No samples for 2.5 s; the usual interval is 0.01 s.");
  setLanguage("zh-CN", zh);
  assert.equal(shown("anomaly.told.gap", gap), "2.5 秒内没有样本，正常每 0.01 秒一个。");
});

test("what was stored before figures were kept, or is newer than this page, is told in the server's words", () => {
  setLanguage("zh-CN", zh);
  const words = '<span lang="en">a &lt;gap&gt;</span>';
  assert.equal(shown("anomaly.told.gap", { detail: "a <gap>" }), words);
  assert.equal(shown("anomaly.told.gap", { detail: "a <gap>", figures: null }), words);
  assert.equal(shown("anomaly.told.gap", { detail: "a <gap>", figures: { other_s: 1 } }), words);
  // Without figures the general sentence of the kind says it all.
  assert.equal(shown("anomaly.told.repeated_time", { detail: "a <gap>", figures: {} }), "");
});

test("a name in a sentence is text, whatever it contains", () => {
  assert.match(shown("markers.told.similar_name", { detail: "", figures: { like: "<b>A1</b>" } }), /&lt;b&gt;A1/);
});
