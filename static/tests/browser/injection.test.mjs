// Script in every text field stays text: each of the payloads is written into every field that the product shows, on a
// real server, and then every screen is opened, in both languages.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";
import { BETWEEN, BLOCKS, CONTROLS, LINES, together } from "./payloads.mjs";
import { findServer, HOW_TO_GET_SERVER, Refused, signInAt, startReal } from "./real.mjs";

const skip = !(await findChrome()) ? HOW_TO_GET_CHROME : (await findServer()) ? false : HOW_TO_GET_SERVER;

const NAME_LETTERS = 80;
const TEXT_LETTERS = 2000;
const PASSWORD = "a sentence nobody says";
/** A name of an account is a field, too. */
const OWNER = "<img data-pwned src=x onerror=alert('pwned')>";
const cell = (/** @type {string} */ text) => `"${text.replaceAll('"', '""')}"`;
const joined = (/** @type {string[]} */ texts) => texts.join(BETWEEN);
/** An apostrophe in front is how spreadsheets guard a formula, and no marker may begin with one. */
/**
 * A marker's name as the server keeps it: forms of a letter as the letter, nothing that cannot be seen.
 * @param {string} name
 */
const kept = (name) =>
  name
    .normalize("NFKC")
    .replace(/[\u00ad\u200b-\u200f\u202a-\u202e\u2060-\u206f\ufe00-\ufe0f\ufeff]/gu, "")
    .trim();
const MARKERS = LINES.map((line, i) => {
  const name = kept(line.startsWith("'") ? `x${line}` : line);
  return LINES.slice(0, i).some((other) => kept(other) === name) ? `twin ${name}` : name;
});
/** Some of each family, where there is one field for each and each takes a screen of its own. */
const SOME = [...LINES.filter((_, i) => i % 8 === 0), LINES[43], LINES[LINES.length - 1]];

/** What a payload would have left behind, in a page: elements, attributes, addresses, documents within. */
function intruders() {
  const found = [];
  for (const el of document.querySelectorAll("*")) {
    if (el.localName.includes("pwned")) found.push(`element ${el.localName}`);
    for (const { name, value } of el.attributes) {
      if (name.includes("pwned") || /^on/.test(name) || name === "srcdoc" || (name === "style" && /pwned/.test(value)))
        found.push(`attribute ${name} of ${el.localName}`);
      if (
        /^(href|src|action|formaction|data|xlink:href)$/.test(name) &&
        /^\s*(javascript|vbscript|data:text)|^\/\/127/i.test(value)
      )
        found.push(`address ${value}`);
    }
  }
  const never = document.querySelectorAll(
    "iframe, frame, object, embed, base, meta[http-equiv], marquee, audio, video, math, plaintext, foreignObject, animate",
  );
  for (const el of never) found.push(`element ${el.localName}`);
  for (const { src } of document.scripts) if (!src.startsWith(`${location.origin}/`)) found.push(`script ${src}`);
  if ("pwned" in window || document.cookie.includes("pwned")) found.push("something that was run");
  return found;
}

/** All that the page says: its texts, and what stands in its fields. */
const said = () =>
  [
    document.body.textContent ?? "",
    ...[...document.querySelectorAll("input, textarea")].map((el) => /** @type {HTMLInputElement} */ (el).value),
  ].join("\n");

describe("script in every text field stays text", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {ReturnType<typeof real.as>} whoever administers it */
  let owner;
  /** @type {Record<string, any>} */
  const made = {};
  const kinds = LINES.filter((line) => [...line].length <= 60);

  before(async () => {
    real = await startReal();
    // Some markers with plain names, which people stand at.
    const plain = Array.from({ length: 12 }, (_, i) => `P${i + 1},${(i * 10).toFixed(1)},0,0`);
    await real.post("/markers/import", `name,e_m,n_m,u_m\n${plain.join("\n")}\n`, { "Content-Type": "text/csv" });
    made.inspectors = [];
    for (const name of LINES) made.inspectors.push(await real.post("/inspectors", { name }));
    for (const [i, name] of MARKERS.entries()) {
      await real.post("/markers", {
        name,
        e_m: -200 + 4 * (i % 50),
        n_m: 60 + 10 * Math.floor(i / 50),
        u_m: 1,
        reason: LINES[i],
      });
    }
    const reasons = together(LINES, 500).map(joined);
    made.reasons = reasons;
    for (const [i, reason] of reasons.entries())
      await real.put(`/markers/P${i + 1}`, { e_m: i * 10 + 0.5, n_m: 0, u_m: 0, reason, force: true });

    made.titles = together(LINES, 200).map(joined);
    for (const [i, title] of made.titles.entries())
      await real.post("/sessions", { inspector_id: made.inspectors[i].id, title });
    // A walk that was walked, with files of such names, at markers of such names.
    const walk = await real.walk("line:20");
    const session = await real.post("/sessions", {
      inspector_id: made.inspectors[31].id,
      title: LINES[0],
      start: { marker: MARKERS[31] },
    });
    made.session = session.id;
    made.fileNames = together(LINES, 200).map(joined).slice(0, 2);
    await real.handIn(session.id, walk, { left: made.fileNames[0], right: made.fileNames[1] });
    made.visited = MARKERS.slice(41, 44);
    await real.post(
      `/sessions/${session.id}/visits`,
      made.visited.map((marker, i) => ({ marker, t_start_s: 12 + 4 * i, t_end_s: 13 + 4 * i })),
    );
    await real.process(session.id);

    made.texts = [...together(LINES, TEXT_LETTERS - 10).map(joined), ...BLOCKS];
    made.faults = [];
    for (const [i, kind] of kinds.entries()) {
      made.faults.push(
        await real.post("/faults", {
          inspector_id: made.inspectors[i].id,
          kind,
          severity: "low",
          text: made.texts[i] ?? LINES[i],
          marker: MARKERS[i],
        }),
      );
    }
    for (const [i, text] of made.texts.entries()) {
      await real.patch(`/faults/${made.faults[i].id}`, {
        comment: text,
        assignee_id: made.inspectors[(i + 5) % LINES.length].id,
      });
    }

    made.presets = together(LINES, NAME_LETTERS).map(joined);
    for (const [i, name] of made.presets.entries()) {
      const column = (/** @type {number} */ k) => LINES[(i + k) % LINES.length];
      await real.post("/mappings", {
        name,
        mapping: {
          time: { column: column(0), unit: "s" },
          gyr: { columns: [column(1), column(2), column(3)], unit: "rad_s" },
          acc: { columns: [column(4), column(5), column(6)], unit: "g" },
        },
      });
    }
    made.imports = LINES.slice(0, 90);
    for (const [i, file_name] of made.imports.entries()) {
      const columns = [0, 1, 2, 3].map((k) => LINES[(i + k) % LINES.length]);
      await real.post(
        `/markers/imports?file_name=${encodeURIComponent(file_name)}`,
        `${columns.map(cell).join(",")}\n${columns.map(cell).join(",")}\n`,
        { "Content-Type": "text/csv" },
      );
    }

    owner = await real.setUp(OWNER, PASSWORD);
    made.accounts = together(LINES, NAME_LETTERS)
      .map(joined)
      .filter((/** @type {string} */ name) => name !== OWNER);
    for (const name of made.accounts) await owner.post("/accounts", { name, password: PASSWORD, role: "viewer" });
    made.tokens = together(LINES, NAME_LETTERS).map(joined);
    for (const name of made.tokens) await owner.post("/tokens", { name, rights: ["read"] });
    await real.as({ "User-Agent": LINES[0] }).cookie("/account/sign-in", { name: OWNER, password: PASSWORD });
  });
  after(() => real?.stop());

  test("what no name may hold is refused by every field of one line", async () => {
    for (const name of CONTROLS) {
      /** @type {[string, () => Promise<unknown>][]} */
      const fields = [
        ["an inspector", () => owner.post("/inspectors", { name })],
        ["a session", () => owner.post("/sessions", { inspector_id: made.inspectors[0].id, title: name })],
        ["a marker", () => owner.post("/markers", { name, e_m: 1, n_m: 2 })],
        ["an account", () => owner.post("/accounts", { name, password: PASSWORD, role: "viewer" })],
        ["a token", () => owner.post("/tokens", { name, rights: ["read"] })],
        [
          "a mapping",
          () =>
            owner.post("/mappings", {
              name,
              mapping: {
                time: { rate_hz: 100, unit: "samples" },
                gyr: { columns: ["a", "b", "c"], unit: "rad_s" },
                acc: { columns: ["d", "e", "f"], unit: "g" },
              },
            }),
        ],
      ];
      for (const [what, write] of fields) {
        await assert.rejects(
          write,
          (error) => error instanceof Refused && error.status === 422,
          `${what} is called ${JSON.stringify(name)}`,
        );
      }
    }
  });

  test("no cell of an export is a formula", async () => {
    for (const line of (await owner.get("/markers.csv")).split("\n").slice(1))
      assert.doesNotMatch(line, /^"?[=+\-@\t]/, line);
    for (const cell of (await owner.get("/audit.csv")).match(/"(?:[^"]|"")*"/g) ?? [])
      assert.doesNotMatch(cell, /^"[=+\-@\t\r]/, cell);
  });

  for (const locale of ["en", "zh-CN"]) {
    test(`on every screen, ${locale}`, { timeout: 300_000 }, async () => {
      const tab = await openPage(real.url, { locale });
      const { page } = tab;
      // Each screen holds all of the payloads: on a busy machine that takes its time.
      page.setDefaultTimeout(90_000);
      page.on("dialog", (dialog) => {
        tab.wrongs.push(`dialog: ${dialog.message()}`);
        dialog.dismiss();
      });
      let place = "";
      const visit = async (/** @type {string} */ hash, /** @type {string} */ sign) => {
        place = hash;
        await page.goto(`${real.url}/${hash}`);
        await page.locator(sign).first().waitFor();
      };
      /** @param {string[]} texts each of which the page says, sooner or later, as it is */
      const says = async (texts) => {
        // A field of one line and HTML's own reading of line ends know "\n" only.
        const wanted = texts.map((text) => text.replaceAll("\r\n", "\n"));
        const lacks = async () => {
          const text = (await page.evaluate(said)).replaceAll("\r\n", "\n");
          return wanted.filter((one) => !text.includes(one));
        };
        const end = Date.now() + 20_000;
        let lacking = await lacks();
        while (lacking.length > 0 && Date.now() < end) {
          await page.waitForTimeout(100);
          lacking = await lacks();
        }
        assert.deepEqual(lacking, [], `${place} does not say`);
        assert.deepEqual(await page.evaluate(intruders), [], `${place} has`);
        assert.deepEqual(tab.wrongs, [], place);
      };
      try {
        await page.goto(`${real.url}/#/live`);
        await page.getByTestId("door").waitFor();
        await signInAt(page, OWNER, PASSWORD);
        // That nobody is signed in yet is said as a refusal of what was asked for first.
        tab.wrongs.splice(0, tab.wrongs.length, ...tab.wrongs.filter((w) => !w.includes("401")));

        await visit("#/live", "[data-testid=inspector-row]");
        await says([...LINES, ...kinds, OWNER]);
        for (const line of SOME) {
          const id = made.inspectors[LINES.indexOf(line)].id;
          await page.locator(`[data-inspector="${id}"]`).click();
          await page.waitForFunction((name) => document.querySelector("#drawer h2")?.textContent === name, line);
        }
        await page.keyboard.press("Escape");
        await page.keyboard.press("g");
        for (const line of SOME) {
          await page.locator("#dialogs [name=name]").fill(`no ${line}`);
          await says([`no ${line}`]);
        }

        await visit("#/sessions", "[data-testid=session-card]");
        await says([...LINES, ...made.titles]);
        await visit(`#/sessions/${made.session}`, "[data-drawn=yes]");
        await page.locator("[data-tab=replay]").click();
        await page.locator("select[name=beside]").focus();
        for (const part of ["quality", "markers", "files"]) await page.locator(`[data-tab=${part}]`).click();
        await says([LINES[0], LINES[31], ...made.visited, ...made.fileNames]);

        await visit("#/faults", "[data-testid=fault-card]");
        await says([...kinds, ...LINES]);
        for (const [i, text] of made.texts.entries()) {
          await page.locator(`[data-testid=faults] [data-fault="${made.faults[i].id}"]`).click();
          await page.locator(`[data-of="${made.faults[i].id}"] [data-part=history] li`).nth(1).waitFor();
          await page.getByTestId("edit-fault").evaluate((el) => el.toggleAttribute("open", true));
          place = `fault ${i}`;
          await says([text.trim(), MARKERS[i], kinds[i]]);
          const history = await page.locator("[data-part=history]").evaluate((el) => el.textContent ?? "");
          assert.ok(
            history.replaceAll("\r\n", "\n").includes(text.replaceAll("\r\n", "\n").trim()),
            `the comment of ${place}`,
          );
        }

        await visit("#/markers", "[data-testid=markers] td");
        await says(MARKERS);
        for (const [i, reason] of made.reasons.entries()) {
          await page.locator(`[data-marker="P${i + 1}"]`).click();
          await page
            .locator("#drawer [data-testid=history] li, #drawer [data-testid=history] p:not(.muted)")
            .first()
            .waitFor();
          await says([reason]);
        }
        await page.locator("[data-do=close]").click();
        for (const line of SOME) {
          const name = MARKERS[LINES.indexOf(line)];
          await page.locator("#side input[type=search]").fill(name);
          await page
            .locator("[data-testid=markers] [data-marker]")
            .evaluateAll(
              (found, wanted) =>
                /** @type {HTMLElement[]} */ (found).find((el) => el.dataset.marker === wanted)?.click(),
              name,
            );
          await page.waitForFunction((wanted) => document.querySelector("#drawer h2")?.textContent === wanted, name);
          await says([line]);
          await page.locator("[data-do=close]").click();
        }
        await page.locator("#side input[type=search]").fill("");
        await page.getByTestId("import-markers").click();
        await page.getByTestId("import-row").first().waitFor();
        await says(made.imports);
        for (let i = 0; i < made.imports.length; i += 15) {
          await page.locator("[data-open]").nth(i).click();
          await page.getByTestId("mapping").waitFor();
          await says([]);
          await page.locator("[data-step=back]").click();
          await page.getByTestId("import-row").first().waitFor();
        }

        await visit("#/upload", "[data-testid=drop]");
        await says(LINES);
        for (const line of SOME) {
          await page.locator("input[name=marker]").fill(`no ${line}`);
          await says([`no ${line}`]);
        }
        const columns = LINES.filter((line) => !/[",;]/.test(line));
        const named = `${columns.join(",")}\n${`${columns.map((_, i) => i % 7).join(",")}\n`.repeat(3)}`;
        // The first eight rows are shown, twelve cells of each: five payloads beside one another. A logger quotes nothing.
        const beside = [0, 1, 2, 3, 4];
        const written = columns.filter((_, i) => i % 2 === (locale === "en" ? 0 : 1));
        const noted = Array.from({ length: 8 }, (_, row) =>
          [row / 100, 1, 2, 3, 0, 0, 9.8, ...beside.map((k) => written[(5 * row + k) % written.length])].join(","),
        );
        const names = ["<img data-pwned src=x onerror=alert(1)>.left.csv", "<b data-pwned>x</b>.right.csv"];
        await page
          .getByTestId("files")
          .setInputFiles(
            [named, `secs,wx,wy,wz,fx,fy,fz,${beside.map((k) => `note${k}`).join(",")}\n${noted.join("\n")}\n`].map(
              (text, i) => ({ name: names[i], mimeType: "text/csv", buffer: Buffer.from(text) }),
            ),
          );
        for (const foot of ["left", "right"])
          await page.getByTestId(`preview-${foot}`).locator("table").waitFor({ state: "attached" });
        await page.getByTestId("mapping").waitFor();
        await says([...names, ...LINES, ...columns, ...made.presets]);
        const cells = await page.getByTestId("preview-right").locator("td").allTextContents();
        assert.deepEqual(
          written.filter((line) => !cells.includes(line)),
          [],
        );

        await visit("#/me", "[data-testid=me]");
        await says(LINES);
        await visit("#/account", "[data-testid=tokens] td");
        await says([OWNER, ...made.tokens]);
        await visit("#/admin/accounts", "[data-testid=accounts] td");
        await says([...LINES, ...made.accounts]);
        await visit("#/admin/tokens", "[data-testid=tokens] td");
        await says(made.tokens);
        await visit("#/admin/audit", "[data-testid=audit] td");
        while (await page.locator("button.more").isVisible()) {
          const rows = await page.locator("[data-testid=audit] tbody tr").count();
          await page.locator("button.more").click();
          await page.waitForFunction(
            (had) => document.querySelectorAll("[data-testid=audit] tbody tr").length > had,
            rows,
          );
        }
        await says([...LINES, ...made.accounts, ...made.tokens]);
        await visit("#/admin/server", ".figures div");
        await says([]);
        await visit("#/api", "[data-testid=routes] details");
        await says([]);
        // Addresses are written by people, too.
        for (const hash of [
          "#/sessions/%3Cimg%20data-pwned%20src=x%20onerror=alert(1)%3E",
          "#/sessions/%",
          "#/%3Cb%20data-pwned%3E",
          "#javascript:alert(1)",
          "#/admin/__proto__",
        ]) {
          place = hash;
          await page.goto("about:blank");
          await page.goto(`${real.url}/${hash}`);
          await page.locator("html[data-ready=yes]").waitFor();
          await page.waitForTimeout(200);
          assert.deepEqual(await page.evaluate(intruders), [], hash);
          // That there is no such walk is told, and shows in the browser's console.
          assert.deepEqual(
            tab.wrongs.filter((w) => !/\b(400|404|422)\b/.test(w)),
            [],
            hash,
          );
        }
      } finally {
        await tab.close();
      }
    });
  }
});
