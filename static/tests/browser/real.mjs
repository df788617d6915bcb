// A real server for a test: an empty data folder, a free port, gone afterwards; and what a test does with it by REST.

import { spawn, spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { once } from "node:events";
import { access, mkdtemp, readFile, rm } from "node:fs/promises";
import { connect, createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const here = fileURLToPath(new URL("../../../", import.meta.url));
const target = process.env.CARGO_TARGET_DIR ?? join(here, "target");
const PLACES = [process.env.LODESTEP_PROGRAM, join(target, "debug/lodestep"), join(target, "release/lodestep")];

export const HOW_TO_GET_SERVER = "no server to test: run `cargo build`, or name the program in LODESTEP_PROGRAM";
export const SETUP_TOKEN = "the setup token of this test";
/** How long a server may take until it serves, ms. */
const START_MS = 60_000;

/** @returns {Promise<string | null>} */
export async function findServer() {
  for (const place of PLACES) {
    if (
      place &&
      (await access(place).then(
        () => true,
        () => false,
      ))
    )
      return place;
  }
  return null;
}

/** An answer that was not expected, with the problem that it told. */
export class Refused extends Error {
  /** @param {string} what @param {number} status @param {any} problem */
  constructor(what, status, problem) {
    super(`${what}: ${status} ${problem?.code ?? ""} ${problem?.detail ?? ""}`);
    this.status = status;
    this.code = problem?.code ?? "";
  }
}

export async function startReal() {
  const program = await findServer();
  if (!program) throw new Error(HOW_TO_GET_SERVER);
  const folder = await mkdtemp(join(tmpdir(), "lodestep-page-"));
  const server = spawn(program, ["serve", "--data", join(folder, "data"), "--listen", "127.0.0.1:0"], {
    env: {
      ...process.env,
      NO_COLOR: "1",
      LODESTEP_LOG: "warn,lodestep_server::serve=info",
      LODESTEP_SETUP_TOKEN: SETUP_TOKEN,
    },
    stdio: ["ignore", "ignore", "pipe"],
  });
  let log = "";
  const url = await /** @type {Promise<string>} */ (
    new Promise((resolve, reject) => {
      const tooLate = setTimeout(() => reject(new Error(`the server did not start; its log:\n${log}`)), START_MS);
      server.on("exit", (code) => reject(new Error(`the server ended with ${code}; its log:\n${log}`)));
      server.stderr.on("data", (chunk) => {
        log += chunk;
        // The server says where it serves, in its log, once it does.
        const found = log.match(/http:\/\/127\.0\.0\.1:\d+/);
        if (!found) return;
        clearTimeout(tooLate);
        resolve(found[0]);
      });
    })
  );

  /**
   * @param {string} method
   * @param {string} path below /api/v1
   * @param {unknown} [body] JSON, or bytes and text as they are
   * @param {Record<string, string>} [headers]
   */
  async function ask(method, path, body, headers = {}) {
    const raw = typeof body === "string" || body instanceof Uint8Array;
    const response = await fetch(`${url}/api/v1${path}`, {
      method,
      headers: { ...(body === undefined || raw ? {} : { "Content-Type": "application/json" }), ...headers },
      body: body === undefined ? undefined : raw ? /** @type {BodyInit} */ (body) : JSON.stringify(body),
    });
    const text = await response.text();
    const json = /json/.test(response.headers.get("content-type") ?? "") ? JSON.parse(text) : text;
    if (!response.ok) throw new Refused(`${method} ${path}`, response.status, json);
    return { json, headers: response.headers };
  }

  /** One who asks, with the headers that say who. @param {Record<string, string>} [who] */
  const asker = (who = {}) => ({
    get: (/** @type {string} */ path) => ask("GET", path, undefined, who).then(({ json }) => json),
    post: (
      /** @type {string} */ path,
      /** @type {unknown} */ body = {},
      /** @type {Record<string, string>} */ headers = {},
    ) => ask("POST", path, body, { ...who, ...headers }).then(({ json }) => json),
    put: (
      /** @type {string} */ path,
      /** @type {unknown} */ body,
      /** @type {Record<string, string>} */ headers = {},
    ) => ask("PUT", path, body, { ...who, ...headers }).then(({ json }) => json),
    patch: (
      /** @type {string} */ path,
      /** @type {unknown} */ body,
      /** @type {Record<string, string>} */ headers = {},
    ) => ask("PATCH", path, body, { ...who, ...headers }).then(({ json }) => json),
    /** What a sign-in sets, for the headers of whoever asks from then on. */
    cookie: async (/** @type {string} */ path, /** @type {unknown} */ body) => {
      const { headers } = await ask("POST", path, body, who);
      return { Cookie: (headers.get("set-cookie") ?? "").split(";")[0] };
    },
  });

  return {
    url,
    /** Whoever works at the machine, as long as nobody has an account. */
    ...asker(),
    as: asker,
    /** @param {string} name @param {string} password makes the first account, an administrator's */
    setUp: async (name, password) =>
      asker(await asker().cookie("/account/set-up", { setup_token: SETUP_TOKEN, name, password })),
    /**
     * Hands both feet of a walk in.
     * @param {string} session
     * @param {Record<"left" | "right", Buffer>} logs
     * @param {Partial<Record<"left" | "right", string>>} [names] of the files
     */
    async handIn(session, logs, names = {}) {
      for (const foot of /** @type {const} */ (["left", "right"])) {
        const log = (await ask("POST", `/sessions/${session}/logs`, { foot, file_name: names[foot] ?? `${foot}.csv` }))
          .json;
        await ask("PATCH", `/logs/${log.id}`, logs[foot], {
          "Upload-Offset": "0",
          "Content-Type": "application/octet-stream",
        });
        await ask("POST", `/logs/${log.id}/finish`, { sha256: createHash("sha256").update(logs[foot]).digest("hex") });
      }
    },
    /**
     * Hands one log in.
     * @param {string} session
     * @param {Record<string, string>} said of it, such as its stream
     * @param {Buffer} log
     */
    async handInOne(session, said, log) {
      const { json } = await ask("POST", `/sessions/${session}/logs`, said);
      await ask("PATCH", `/logs/${json.id}`, log, {
        "Upload-Offset": "0",
        "Content-Type": "application/octet-stream",
      });
      await ask("POST", `/logs/${json.id}/finish`, { sha256: createHash("sha256").update(log).digest("hex") });
    },
    /** @param {string} session works it out, until that is done */
    async process(session) {
      let { json: job } = await ask("POST", `/sessions/${session}/process`, {});
      while (!["finished", "failed"].includes(job.state)) {
        await new Promise((resolve) => setTimeout(resolve, 100));
        ({ json: job } = await ask("GET", `/jobs/${job.id}`));
      }
      if (job.state === "failed") throw new Error(`the walk was not worked out: ${JSON.stringify(job.error)}`);
    },
    /** The walk that `lodestep simulate` writes. @param {string} kind @param {number} [seed] */
    async walk(kind, seed = 1) {
      const out = join(folder, `walk-${kind.replace(/\W/g, "-")}-${seed}`);
      const done = spawnSync(program, ["simulate", "--walk", kind, "--seed", String(seed), "--out", out, "--force"], {
        encoding: "utf8",
      });
      if (done.status !== 0) throw new Error(`simulate: ${done.stderr}`);
      const text = (/** @type {string} */ name) => readFile(join(out, `${name}.csv`), "utf8");
      const [markers, visits, truth] = await Promise.all([text("markers"), text("visits"), text("truth")]);
      return {
        left: await readFile(join(out, "left.csv")),
        right: await readFile(join(out, "right.csv")),
        markers,
        visits,
        truth,
      };
    },
    async stop() {
      server.removeAllListeners("exit");
      const ended = once(server, "exit");
      server.kill();
      await ended;
      await rm(folder, { recursive: true, force: true });
    },
  };
}

/**
 * Signs in at the door of a page that shows it.
 * @param {import("playwright-core").Page} page
 * @param {string} name
 * @param {string} password
 */
export async function signInAt(page, name, password) {
  await page.locator("[data-testid=door] [name=name]").fill(name);
  await page.locator("[data-testid=door] [name=password]").fill(password);
  await page.keyboard.press("Enter");
  await page.locator("html[data-ready=yes]").waitFor();
}

/** One white pixel. */
export const PNG = Buffer.from(
  "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsGl0wAAAAABJRU5ErkJggg==",
  "base64",
);

/**
 * A link to a server that a test can cut: what stands is torn, what comes is refused until it is mended. The browser's
 * own "offline" holds for a page alone, and its worker is asked again whenever the browser starts it anew.
 * @param {string} server
 */
export async function linkTo(server) {
  const { hostname: host, port } = new URL(server);
  /** @type {Set<import("node:net").Socket>} */
  const open = new Set();
  let cut = false;
  const link = createServer((near) => {
    if (cut) {
      near.resetAndDestroy();
      return;
    }
    const far = connect({ host, port: Number(port) });
    for (const [end, other] of [
      [near, far],
      [far, near],
    ]) {
      open.add(end);
      end.pipe(other);
      end.on("error", () => other.destroy());
      end.on("close", () => {
        open.delete(end);
        other.destroy();
      });
    }
  });
  link.listen(0, "127.0.0.1");
  await once(link, "listening");
  const address = /** @type {import("node:net").AddressInfo} */ (link.address());
  const tear = () => {
    for (const end of open) end.destroy();
  };
  return {
    url: `http://127.0.0.1:${address.port}`,
    cut() {
      cut = true;
      tear();
    },
    mend() {
      cut = false;
    },
    async stop() {
      tear();
      link.close();
      await once(link, "close");
    },
  };
}
