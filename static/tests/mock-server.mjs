// A server that plays docs/wire.md for the page alone: `npm run mock`, then open the address it prints.
// The browser tests start it on a free port and give it orders (`cut`, `site.muted`, `dropAfterBytes`).

import { createHash } from "node:crypto";
import { createReadStream } from "node:fs";
import { stat } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { acceptWebSocket } from "./mock/websocket.mjs";
import { previewOf } from "./mock/preview.mjs";
import { charts } from "./mock/charts.mjs";
import { MockFaults } from "./mock/faults.mjs";
import { MockLab } from "./mock/lab.mjs";
import { MockMarkers } from "./mock/markers.mjs";
import { MockSite, iso } from "./mock/site.mjs";
import { MockWebhooks } from "./mock/webhooks.mjs";
import { searchSessions } from "./mock/session_search.mjs";
import { PEDESTRIAN } from "./mock/systems.mjs";
import { MockStaff } from "./mock/staff.mjs";

const ROOT = fileURLToPath(new URL("..", import.meta.url));
const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".json": "application/json",
  ".svg": "image/svg+xml",
};
const CSP = "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'";

/**
 * @param {{port?: number, stepMs?: number, crowd?: number, systems?: import("../js/systems/generic.js").Declaration[]}} [options]
 *   `crowd`: see `MockSite`
 */
export async function startMock({ port = 0, stepMs = 500, crowd = 0, systems = [PEDESTRIAN] } = {}) {
  // A crowd walks in real time; the four whom the tests know walk half a second a step, however often they step.
  const site = new MockSite(crowd > 0 ? { crowd, stepS: stepMs / 1000 } : {});
  const staff = new MockStaff();
  const finished = site.finishedWalk();
  const faults = new MockFaults(site);
  const markers = new MockMarkers(site.plan.nodes);
  const webhooks = new MockWebhooks();
  const lab = new MockLab((changes) => site.publish(changes));
  const logs = new Map();
  const jobs = new Map();
  const mappings = [];
  /** Visits that were keyed in. */
  const told = [];
  /** @type {Map<string, any>} */
  const walks = new Map([
    [
      "s9",
      {
        id: "s9",
        inspector_id: "i5",
        title: "Spiral, evening",
        state: "finished",
        started_at: iso(-9e6),
        ended_at: iso(-7.8e6),
        feet: ["left", "right"],
        samples: 240_000,
        epochs: 120_000,
        duration_s: 1200,
        distance_m: 1440.2,
        track_sha256: "5e1c".repeat(16),
        logs: [
          {
            id: "l1",
            foot: "left",
            file_name: "left.csv.gz",
            size_bytes: 5_100_000,
            samples: 120_000,
            state: "accepted",
          },
        ],
        visits: 9,
        anomalies: 1,
      },
    ],
    [
      "s8",
      {
        id: "s8",
        inspector_id: "i4",
        title: "Second team",
        state: "finished",
        started_at: iso(-8.6e6),
        ended_at: iso(-7.4e6),
        feet: ["left", "right"],
        samples: 240_000,
        epochs: 120_000,
        duration_s: 1200,
        distance_m: 1440.2,
        track_sha256: "7a10".repeat(16),
        logs: [],
        visits: 9,
        anomalies: 0,
      },
    ],
  ]);
  const orders = { dropAfterBytes: Infinity, refused: false, loseVisitAnswer: false, farMarker: "" };
  /** @type {Set<{cut(): void}>} */
  const sockets = new Set();

  const server = createServer(async (request, response) => {
    const url = new URL(request.url ?? "/", "http://mock");
    const path = url.pathname;
    const chunks = [];
    for await (const chunk of request) chunks.push(chunk);
    const body = Buffer.concat(chunks);
    const json = (value, status = 200, headers = {}) => {
      response.writeHead(status, {
        "Content-Type": status >= 400 ? "application/problem+json" : "application/json",
        ...headers,
      });
      response.end(JSON.stringify(value));
    };
    const problem = (status, code, detail, where) =>
      json({ type: "about:blank", title: code, status, code, detail, where }, status);
    if (!path.startsWith("/api/v1/")) return serveFile(path, response);
    const [noun, id, part, number] = path.slice("/api/v1/".length).split("/").map(decodeURIComponent);
    const route = `${request.method} ${noun}${id ? "/:id" : ""}${part ? `/${part}` : ""}`;
    const given = () => JSON.parse(body.toString() || "{}");
    const ofStaff = staff.answer(
      request.method ?? "GET",
      [noun, id, part],
      /json/.test(request.headers["content-type"] ?? "") ? given() : {},
    );
    if (ofStaff) {
      const [status, value] = ofStaff;
      if (status === 204) return response.writeHead(204).end();
      return json(value, status);
    }
    if (!staff.known) return problem(401, "not_signed_in", "expected somebody who has signed in");
    if (noun === "markers") {
      const told = markers.answer(String(request.method), [id, part, number], url, body.toString());
      if (!told) return problem(404, "no_such_route", `expected a path of docs/wire.md, found ${route}`);
      if (told.status !== 204) return json(told.value, told.status);
      response.writeHead(204).end();
      return;
    }
    if (noun === "lab") {
      const told = lab.answer(String(request.method), [id, part, number], url.searchParams, given());
      if (told?.status === 204) return response.writeHead(204).end();
      if (told) return json(told.value, told.status);
    }
    if (noun === "webhooks") {
      const told = webhooks.answer(String(request.method), [id, part], given());
      if (told?.status === 204) return response.writeHead(204).end();
      if (told) return json(told.value, told.status);
    }
    if (noun === "faults") {
      const told = faults.answer(String(request.method), [id, part, number], body);
      if (told?.bytes) return response.writeHead(told.status, { "Content-Type": String(told.type) }).end(told.bytes);
      if (told?.status === 204) return response.writeHead(204).end();
      if (told) return json(told.value, told.status);
    }
    switch (route) {
      case "GET site":
        return json({
          name: "FAST (demo)",
          latitude_deg: 25.652944,
          longitude_deg: 106.856667,
          height_m: 1110,
          gravity_m_s2: 9.787,
          declination_deg: -2.45,
        });
      case "GET site/:id":
        return json(site.plan);
      case "GET systems":
        return json({ systems });
      case "GET inspectors":
        return json(site.inspectors);
      case "POST inspectors": {
        const inspector = { id: `i${site.inspectors.length + 1}`, name: given().name, created_at: iso(0) };
        site.inspectors.push(inspector);
        return json(inspector, 201);
      }
      case "GET moment":
        return json(site.moment(Date.parse(url.searchParams.get("at") ?? "")));
      case "GET alarms":
        return json({ lost_after_s: 60, standing_after_s: 900, gone_after_s: 3600, alarms: site.alarms() });
      case "GET known-logs":
      case "GET alarms/:id":
        return json([]);
      case "POST alarms/:id": {
        const { key } = given();
        const acknowledged = { key, acknowledged_at: iso(0), acknowledged_by: "somebody at this machine" };
        site.publish([{ kind: "alarm", acknowledged }]);
        return json(acknowledged);
      }
      case "GET sessions":
        return json([...walks.values(), ...site.sessions.values()]);
      case "POST sessions": {
        const again = walks.get(given().id);
        if (again) return json(again);
        const row = {
          id: `s${100 + walks.size}`,
          state: "created",
          samples: 0,
          epochs: 0,
          duration_s: 0,
          distance_m: 0,
          started_at: iso(0),
          logs: [],
          ...given(),
        };
        walks.set(row.id, row);
        return json(row, 201);
      }
      case "PUT sessions/:id/note":
        return json(Object.assign(walks.get(id), given()));
      case "GET sessions/:id/note":
        return json({ starred: walks.get(id)?.starred ?? false, note: walks.get(id)?.note ?? "" });
      case "GET sessions/:id":
        if (id === "search")
          return json(
            searchSessions([...walks.values(), ...site.sessions.values()], site.inspectors, url.searchParams),
          );
        if (id === "waiting") return json([]);
        return walks.has(id)
          ? json(walks.get(id))
          : site.sessions.has(id)
            ? json({ ...site.sessions.get(id), logs: [] })
            : problem(404, "no_such_session", `expected a session's id, found ${id}`);
      case "DELETE sessions/:id":
        if (!walks.delete(id)) return problem(404, "no_such_session", `expected a session's id, found ${id}`);
        response.writeHead(204).end();
        return;
      case "GET sessions/:id/visits":
        return json(walks.has(id) && walks.get(id).state === "finished" ? finished.visits : []);
      case "GET sessions/:id/report":
        return id === "s9" || walks.get(id)?.state === "finished"
          ? json(finished.report)
          : problem(409, "no_report", "expected a session that has been processed, found one that has not");
      case "GET sessions/:id/stands":
        return json(id === "s9" ? finished.stands : []);
      case "PATCH sessions/:id":
        return json(Object.assign(walks.get(id), given()));
      case "PUT sessions/:id/stands": {
        const stand = finished.stands.find((s) => s.number === Number(number));
        const visit = {
          id: `v-stand-${number}`,
          session_id: id,
          marker: given().marker,
          t_start_ns: stand.t_start_ns,
          t_end_ns: stand.t_end_ns,
          origin: "chosen",
        };
        finished.visits.push(visit);
        return json(visit);
      }
      case "DELETE sessions/:id/stands":
        finished.visits = finished.visits.filter((v) => v.id !== `v-stand-${number}`);
        response.writeHead(204).end();
        return;
      case "GET sessions/:id/anomalies":
        return json(
          id === "s9"
            ? [
                {
                  anomaly: "gap",
                  foot: "left",
                  t_start_ns: 431.2e9,
                  t_end_ns: 431.9e9,
                  samples: 70,
                  detail: "expected a sample every 10 ms, found none for 700 ms",
                },
              ]
            : [],
        );
      case "POST sessions/:id/visits": {
        if (request.headers["content-type"]?.startsWith("text/csv")) return json([], 201);
        const asked = given();
        const t_start_ns = asked.t_start_s * 1e9;
        let visit = told.find((v) => v.session_id === id && v.marker === asked.marker && v.t_start_ns === t_start_ns);
        const added = visit ? 0 : 1;
        if (!visit) {
          visit = {
            id: `v-keyed-${told.length + 1}`,
            session_id: id,
            marker: asked.marker,
            t_start_ns,
            t_end_ns: asked.t_end_s * 1e9,
            origin: "keyed",
          };
          told.push(visit);
          const far = asked.marker === orders.farMarker;
          site.publish([
            {
              kind: "visit",
              ...visit,
              ...(far
                ? { accepted: false, nis: 61.2, reason: "expected within 4.1 m, found 38.0 m" }
                : { accepted: true, nis: 1.1, reason: "" }),
            },
          ]);
        }
        if (orders.loseVisitAnswer) {
          orders.loseVisitAnswer = false;
          return request.socket.destroy();
        }
        return json(
          { added, unchanged: 1 - added, overlaps: [], visits: told.filter((v) => v.session_id === id) },
          added ? 201 : 200,
        );
      }
      case "DELETE sessions/:id/visits": {
        const at = told.findIndex((v) => v.id === number);
        if (at < 0) return problem(404, "visit_not_found", `there is no visit ${number}`);
        told.splice(at, 1);
        site.publish([{ kind: "visit_removed", session_id: id, id: number }]);
        response.writeHead(204).end();
        return;
      }
      case "POST logs/:id":
        if (id === "preview")
          return json(
            previewOf(
              body.toString("latin1", 0, 5000),
              url.searchParams.get("part") === "true",
              JSON.parse(url.searchParams.get("reading") ?? "{}"),
            ),
          );
        return problem(404, "no_such_route", "expected /logs/preview");
      case "POST logs/:id/preview":
        return json(previewOf(logs.get(id).data.toString("latin1", 0, 5000), false, given().reading ?? {}));
      case "GET mappings":
        return json(mappings);
      case "POST mappings": {
        const named = { id: `m${mappings.length + 1}`, created_at: iso(0), updated_at: iso(0), ...given() };
        mappings.push(named);
        return json(named, 201);
      }
      case "GET sessions/:id/charts":
        return json(charts(url.searchParams));
      case "GET sessions/:id/track": {
        const run = url.searchParams.get("run") ?? "main";
        const found = lab.runs.some((r) => r.id === run)
          ? finished.without_markers
          : (finished[run] ?? { ...finished.main, rows: [] });
        const [from_s, to_s] = [
          Number(url.searchParams.get("from_s") ?? 0),
          Number(url.searchParams.get("to_s") ?? Infinity),
        ];
        return json({ ...found, rows: found.rows.filter(([t_s]) => t_s >= from_s && t_s <= to_s) });
      }
      case "POST sessions/:id/logs": {
        const asked = given();
        const known = [...logs.values()].find(
          (l) => l.sha256 === asked.sha256 && l.session_id === id && l.foot === asked.foot && l.state === "accepted",
        );
        if (known) return json({ ...row(known), state: "unchanged" });
        const log = {
          id: `l${100 + logs.size}`,
          session_id: id,
          ...asked,
          state: "receiving",
          data: Buffer.alloc(0),
          samples: 0,
        };
        logs.set(log.id, log);
        return json(row(log), 201);
      }
      case "HEAD logs/:id":
      case "GET logs/:id": {
        const log = logs.get(id);
        return log
          ? json(row(log), 200, { "Upload-Offset": log.data.length })
          : problem(404, "no_such_log", `expected a log's id, found ${id}`);
      }
      case "PATCH logs/:id": {
        const log = logs.get(id);
        if (Number(request.headers["upload-offset"]) !== log.data.length) {
          return json({ status: 409, code: "wrong_offset", title: "wrong offset", detail: "wrong offset" }, 409, {
            "Upload-Offset": log.data.length,
          });
        }
        log.data = Buffer.concat([log.data, body]);
        if (log.data.length > orders.dropAfterBytes) {
          // The bytes are on disk, the answer is lost on the way.
          orders.dropAfterBytes = Infinity;
          return request.socket.destroy();
        }
        response.writeHead(204, { "Upload-Offset": log.data.length });
        return response.end();
      }
      case "POST logs/:id/finish": {
        const log = logs.get(id);
        if (createHash("sha256").update(log.data).digest("hex") !== given().sha256)
          return problem(422, "wrong_hash", "the bytes that arrived are not those that were hashed");
        if (!log.data.toString("latin1", 0, 400).includes("gyr_x_rad_s")) {
          logs.delete(id);
          return problem(
            422,
            "wrong_column",
            "expected the column gyr_x_rad_s, found none; give rad/s under that name",
            { line: 1, column: "gyr_x_rad_s" },
          );
        }
        log.state = "accepted";
        return json(row(log));
      }
      case "POST sessions/:id/process": {
        const job = { id: `j${jobs.size + 1}`, session_id: id, state: "running", stage: "filter", progress: 0.2 };
        jobs.set(job.id, job);
        return json(job, 202);
      }
      case "GET jobs/:id": {
        const job = jobs.get(id);
        job.progress = Math.min(1, job.progress + 0.4);
        if (job.progress >= 1) {
          job.state = "finished";
          Object.assign(walks.get(job.session_id), {
            state: "finished",
            epochs: 1000,
            samples: 2000,
            duration_s: 1200,
            distance_m: 1440,
          });
        }
        return json(job);
      }
      case "GET faults":
        return json(
          site.faults.filter((f) => !url.searchParams.get("state") || f.state === url.searchParams.get("state")),
        );
      case "POST faults": {
        const asked = given();
        const again = site.faults.find((f) => f.id === asked.id);
        if (again) return json(again);
        const walk = site.walks.find((w) => w.session.id === asked.session_id) ?? site.walks[0];
        const [e, n] = walk.position.position_m;
        const near = site.plan.nodes
          .map((m) => ({ marker: m.name, distance_m: Math.hypot(m.e_m - e, m.n_m - n) }))
          .sort((a, b) => a.distance_m - b.distance_m)
          .slice(0, 5);
        const fault = {
          id: `f${site.faults.length + 1}`,
          inspector_id: walk.inspector.id,
          text: "",
          marker: null,
          state: "open",
          assignee_id: null,
          photos: 0,
          version: 1,
          reported_at: iso(0),
          position_m: walk.position.position_m,
          sigma_m: walk.position.sigma_m,
          candidates: near.map((c, i) => ({ ...c, probability: [0.5, 0.25, 0.15, 0.07, 0.03][i] })),
          ...asked,
        };
        site.faults.push(fault);
        site.publish([{ kind: "fault", fault }]);
        return json(fault, 201);
      }
      default:
        return problem(404, "no_such_route", `expected a path of docs/wire.md, found ${route}`);
    }
  });

  server.on("upgrade", (request, socket) => {
    if (orders.refused || !request.url?.startsWith("/api/v1/feed")) return socket.destroy();
    const feed = acceptWebSocket(request, /** @type {import("node:net").Socket} */ (socket), (text) => {
      const hello = JSON.parse(text);
      for (const message of site.answer(hello)) feed.send(message);
      site.listeners.add(feed.send);
    });
    sockets.add(feed);
    socket.on("close", () => {
      sockets.delete(feed);
      site.listeners.delete(feed.send);
    });
  });
  const walking = setInterval(() => site.step(), stepMs);
  const beating = setInterval(() => {
    for (const send of site.listeners) send({ type: "heartbeat", seq: site.seq, server_time: iso(0) });
  }, 2000);
  await new Promise((resolve) => server.listen(port, "127.0.0.1", () => resolve(undefined)));
  const address = /** @type {import("node:net").AddressInfo} */ (server.address());
  return {
    url: `http://127.0.0.1:${address.port}`,
    site,
    staff,
    markers,
    faults,
    lab,
    webhooks,
    walks,
    orders,
    cut: () => sockets.forEach((s) => s.cut()),
    stop() {
      clearInterval(walking);
      clearInterval(beating);
      sockets.forEach((s) => s.cut());
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

function row({ data, ...log }) {
  return { ...log, offset_bytes: data.length };
}

/**
 * @param {string} path
 * @param {import("node:http").ServerResponse} response
 */
async function serveFile(path, response) {
  const file = join(ROOT, normalize(path === "/" ? "/index.html" : path));
  const found = file.startsWith(ROOT) ? await stat(file).catch(() => null) : null;
  if (!found?.isFile()) {
    response.writeHead(404);
    response.end();
    return;
  }
  response.writeHead(200, {
    "Content-Type": TYPES[extname(file)] ?? "application/octet-stream",
    "Content-Security-Policy": CSP,
  });
  createReadStream(file).pipe(response);
}

if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) {
  const mock = await startMock({ port: Number(process.env.PORT ?? 8099) });
  console.log(`mock server: ${mock.url}`);
}
