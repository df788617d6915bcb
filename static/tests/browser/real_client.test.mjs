// The description of the API, by what is made from it: a client whose types fit a walk from creation to track, and that
// walk on a real server.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { copyFile, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { clientOf } from "../../scripts/client.mjs";
import { findServer, HOW_TO_GET_SERVER, startReal } from "./real.mjs";

const page = fileURLToPath(new URL("../../", import.meta.url));
const skip = (await findServer()) ? false : HOW_TO_GET_SERVER;

describe("a client that is made from the description, on a real server", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startReal>>} */
  let real;
  /** @type {string} */
  let folder;

  before(async () => {
    real = await startReal();
    folder = await mkdtemp(join(tmpdir(), "lodestep-client-"));
    for (const [name, text] of Object.entries(clientOf(await real.get("/openapi.json"))))
      await writeFile(join(folder, name), text);
    await copyFile(join(page, "tests/client/walk.mjs"), join(folder, "walk.mjs"));
    const compilerOptions = {
      ...{ allowJs: true, checkJs: true, strict: true, noEmit: true, skipLibCheck: false },
      ...{ target: "es2022", module: "nodenext", lib: ["es2023", "dom", "dom.iterable"] },
      ...{ types: ["node"], typeRoots: [join(page, "node_modules/@types")] },
    };
    await writeFile(join(folder, "tsconfig.json"), JSON.stringify({ compilerOptions, files: ["walk.mjs"] }));
  });
  after(async () => {
    await real?.stop();
    if (folder) await rm(folder, { recursive: true, force: true });
  });

  test("the walk takes and gives what the types of the client say", { timeout: 120_000 }, () => {
    const tsc = spawnSync(join(page, "node_modules/.bin/tsc"), ["--project", folder], { encoding: "utf8" });
    assert.equal(tsc.status, 0, tsc.stdout + tsc.stderr);
  });

  test("a walk goes from its creation to its track", { timeout: 600_000 }, async () => {
    const { walk } = await import(pathToFileURL(join(folder, "walk.mjs")).href);
    const made = await walk(real.url, await real.walk("line:20"));
    assert.equal(made.session.title, "By a made client");
    assert.equal(made.session.state, "finished");
    assert.ok(made.e_m.length > 10, `${made.e_m.length} points`);
    assert.ok(Math.abs(made.e_m[0] - 1) < 0.5 && Math.abs(made.n_m[0] - 2) < 0.5, "it begins where it was said to");
    const away_m = made.e_m.map((/** @type {number} */ e, /** @type {number} */ k) =>
      Math.hypot(e - 1, made.n_m[k] - 2),
    );
    const farthest_m = Math.max(...away_m);
    assert.ok(farthest_m > 18 && farthest_m < 22, `a line of 20 m goes ${farthest_m} m away`);
    assert.ok(made.csv.split("\n").length > made.e_m.length, "the file has every epoch");
    assert.ok(made.parameters > 10, `${made.parameters} parameters`);
  });

  test("a refusal has a code that is told of its operation", async () => {
    const { refusalOfNobody } = await import(pathToFileURL(join(folder, "walk.mjs")).href);
    assert.equal(await refusalOfNobody(real.url), "inspector_not_found");
  });
});
