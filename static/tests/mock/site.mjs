// What happens on the mock's site: people who walk the spiral road, visits, revisions, faults. Plays the
// feed's contract; knows nothing of HTTP.

import { crowdFaults, makeCrowd } from "./crowd.mjs";
import { makePlan } from "./plan.mjs";

const NAMES = ["Chen Wei", "李娜", "Okafor, Ada", "Zhang Min", "Novak, Petr"];
const STEP_S = 0.5;

export class MockSite {
  /**
   * @param {{crowd?: number, stepS?: number}} [options] `crowd`: so many people all over the site, each with the trail
   *   of half an hour, instead of the four whom the tests know; `stepS`: how much time goes by from step to step, s
   */
  constructor({ crowd = 0, stepS = STEP_S } = {}) {
    this.stepS = stepS;
    this.plan = makePlan();
    this.boot = "boot-1";
    this.seq = 100;
    /** @type {Set<(message: any) => void>} */
    this.listeners = new Set();
    this.history = [];
    this.inspectors = NAMES.map((name, i) => ({ id: `i${i + 1}`, name, created_at: iso(-86_400_000) }));
    this.walks = this.inspectors.slice(0, 4).map((inspector, i) => this.beginWalk(inspector, i));
    if (crowd > 0) {
      this.walks = makeCrowd(this, crowd);
      this.inspectors = this.walks.map((walk) => walk.inspector);
    }
    this.sessions = new Map(this.walks.map((walk) => [walk.session.id, walk.session]));
    this.faults = [
      fault(
        "f1",
        "i1",
        "hydraulic_leak",
        "high",
        [62, 104, 30],
        [
          ["A57", 0.61, 4.2],
          ["A58", 0.24, 8.8],
          ["A46", 0.1, 10.9],
        ],
      ),
      fault(
        "f2",
        "i2",
        "communication_loss",
        "medium",
        [-118, -64, 40],
        [
          ["D91", 0.48, 5.1],
          ["D78", 0.31, 7.7],
          [null, 0.21, null],
        ],
      ),
      fault("f3", "i3", "panel_damage", "low", [35, -150, 45], [["C120", 0.72, 2.9]]),
    ];
    if (crowd > 0) this.faults = crowdFaults(this, crowd);
    /** Whose positions are held back. */
    this.muted = new Set();
  }

  beginWalk(inspector, i) {
    const session = {
      id: `s${i + 1}`,
      inspector_id: inspector.id,
      title: "",
      state: "live",
      started_at: iso(-(600 + 400 * i) * 1000),
      ended_at: null,
      feet: ["left", "right"],
      samples: 0,
      epochs: 0,
      duration_s: 0,
      distance_m: 0,
    };
    const walk = {
      session,
      inspector,
      s: 120 + 420 * i,
      speed: 1.1 + 0.1 * i,
      t_s: 600 + 400 * i,
      since_m: 40 + 90 * i,
      since_s: 30 + 75 * i,
      sigma: 0.8 + 0.9 * i,
      standing: 0,
      trail: [],
      visits: [],
      stands: [],
      anomalies: [],
      position: null,
    };
    for (let k = 240; k > 0; k--) {
      const [e, n] = this.onRoad(walk.s - k * 0.55);
      walk.trail.push([Math.round((walk.t_s - k * STEP_S) * 1e9), e, n]);
    }
    if (i === 0)
      walk.visits.push({
        session_id: session.id,
        id: "v1",
        marker: "A57",
        t_start_ns: 478e9,
        t_end_ns: 482e9,
        t_applied_ns: 480e9,
        accepted: true,
        nis: 1.8,
        before_minus_marker_m: [2.1, -1.4, 0.2],
        after_minus_marker_m: [0.2, -0.1, 0],
        reason: "",
      });
    if (i === 2)
      walk.stands.push({
        number: 1,
        t_start_ns: 700e9,
        t_end_ns: 709e9,
        lasts: false,
        position_m: [0, 0, 0],
        candidates: [
          { marker: "A58", probability: 0.62, distance_m: 2.2 },
          { marker: "A46", probability: 0.3, distance_m: 7.2 },
          { marker: null, probability: 0.08, distance_m: null },
        ],
      });
    if (i === 2)
      walk.anomalies.push({
        session_id: session.id,
        anomaly: "magnetic_field",
        foot: "left",
        t_start_ns: 305e9,
        t_end_ns: 318e9,
        samples: 1300,
        detail: "the field has been outside 40 to 60 µT for 5 stances, now 71 µT",
        figures: { weakest_ut: 40, strongest_ut: 60, stances: 5, found_ut: 71.25 },
      });
    this.place(walk);
    return walk;
  }

  /** @param {number} s metres along the road */
  onRoad(s) {
    const { road } = this.plan;
    let left = Math.max(0, s);
    for (let i = 1; i < road.length; i++) {
      const d = Math.hypot(road[i][0] - road[i - 1][0], road[i][1] - road[i - 1][1]);
      if (left <= d) {
        const f = left / d;
        return [road[i - 1][0] + f * (road[i][0] - road[i - 1][0]), road[i - 1][1] + f * (road[i][1] - road[i - 1][1])];
      }
      left -= d;
    }
    return road[road.length - 1];
  }

  place(walk) {
    const [e, n] = this.onRoad(walk.s);
    const [e2, n2] = this.onRoad(walk.s + 1);
    const along = walk.sigma * 0.6;
    const across = walk.sigma;
    const a = Math.atan2(e2 - e, n2 - n);
    const [see, snn] = [
      (across * Math.cos(a)) ** 2 + (along * Math.sin(a)) ** 2,
      (across * Math.sin(a)) ** 2 + (along * Math.cos(a)) ** 2,
    ];
    walk.position = {
      session_id: walk.session.id,
      inspector_id: walk.inspector.id,
      t_ns: Math.round(walk.t_s * 1e9),
      position_m: [e, n, 12.5],
      heading_rad: a,
      sigma_m: [Math.sqrt(see), Math.sqrt(snn), 0.7],
      covariance_en_m2: (along ** 2 - across ** 2) * Math.sin(a) * Math.cos(a),
      speed_m_s: walk.standing > 0 ? 0 : walk.speed,
      state: walk.standing > 0 ? "standing" : "walking",
      since_marker_s: walk.since_s,
      since_marker_m: walk.since_m,
      distance_m: walk.s,
      received_at: iso(0),
    };
  }

  /** One step of time goes by. */
  step() {
    const { stepS } = this;
    const changes = [];
    for (const walk of this.walks) {
      walk.t_s += stepS;
      walk.since_s += stepS;
      if (walk.standing > 0) walk.standing -= stepS;
      else {
        walk.s += walk.speed * stepS;
        walk.since_m += walk.speed * stepS;
        walk.sigma = Math.min(7, walk.sigma + 0.004);
        if (walk.t_s % 40 < stepS) walk.standing = 6;
      }
      this.place(walk);
      if (this.muted.has(walk.inspector.id)) continue;
      const [e, n] = walk.position.position_m;
      walk.trail.push([walk.position.t_ns, e, n]);
      changes.push({ kind: "position", ...walk.position });
    }
    if (changes.length > 0) this.publish(changes);
  }

  /** @param {any[]} changes */
  publish(changes) {
    this.seq += 1;
    const message = { type: "changes", seq: this.seq, server_time: iso(0), changes };
    this.history.push(message);
    if (this.history.length > 60) this.history.shift();
    for (const listener of this.listeners) listener(message);
  }

  /** As the server raises them: of faults of high severity that are open. */
  alarms() {
    return this.faults
      .filter((f) => f.state === "open" && f.severity === "high")
      .map((f) => ({
        key: `fault:${f.id}`,
        kind: "fault",
        session_id: null,
        inspector_id: f.inspector_id,
        fault_id: f.id,
        since: f.reported_at,
        raised_at: f.reported_at,
      }));
  }

  /** Where everybody was: the walks as they are now, cut off at the moment. @param {number} at_ms */
  moment(at_ms) {
    const walks = this.walks.flatMap((w) => {
      const then_ns = (at_ms - Date.parse(w.session.started_at)) * 1e6;
      const trail = w.trail.filter(([t_ns]) => t_ns <= then_ns);
      const last = trail[trail.length - 1];
      if (then_ns < 0) return [];
      const position = last && {
        t_ns: last[0],
        age_s: Math.max(0, (then_ns - last[0]) / 1e9),
        position_m: [last[1], last[2], 0],
        heading_rad: 0.5,
        sigma_heading_rad: 0.1,
        sigma_m: [0.8, 0.8, 0.5],
        covariance_en_m2: 0,
      };
      return [{ session: w.session, position: position ?? null, trail }];
    });
    return { at: new Date(at_ms).toISOString(), walks };
  }

  snapshot() {
    return {
      type: "snapshot",
      boot: this.boot,
      seq: this.seq,
      server_time: iso(0),
      inspectors: this.inspectors,
      sessions: this.walks.map((w) => ({
        ...w.session,
        trail: w.trail,
        position: w.position,
        visits: w.visits,
        stands: w.stands,
        anomalies: w.anomalies,
      })),
      faults: this.faults.filter((f) => f.state !== "verified"),
      alarms: this.alarms(),
      markers_revision: 7,
    };
  }

  /** @param {{since?: number, boot?: string}} hello */
  answer(hello) {
    const since = hello.since ?? -1;
    if (hello.boot !== this.boot || since < (this.history[0]?.seq ?? this.seq + 1) - 1) return [this.snapshot()];
    return [{ type: "heartbeat", seq: since, server_time: iso(0) }, ...this.history.filter((m) => m.seq > since)];
  }

  /** A finished walk for the session screen: true road, drifting without markers, pulled back by each. */
  finishedWalk() {
    const columns = [
      "t_s",
      "e_m",
      "n_m",
      "u_m",
      "heading_rad",
      "sigma_e_m",
      "sigma_n_m",
      "sigma_u_m",
      "left_stance",
      "right_stance",
    ];
    const main = [];
    const without = [];
    const visits = [];
    let drift = [0, 0];
    for (let k = 0; k <= 2400; k++) {
      const s = k * 0.6;
      const t_s = k * 0.5;
      const [e, n] = this.onRoad(s + 60);
      const f = s / 1440;
      const off = [11 * f * Math.sin(4 * f), -9 * f * f * 1.5];
      const since = [off[0] - drift[0], off[1] - drift[1]];
      const sigma = 0.4 + 0.018 * (s % 150);
      // Nothing was recorded for six seconds.
      if (t_s > 431 && t_s < 437) continue;
      main.push([t_s, e + since[0], n + since[1], 0, 0.3, sigma, sigma * 0.8, 0.3, k % 2, 1 - (k % 2)]);
      without.push([t_s, e + off[0], n + off[1], 0, 0.3, 0.4 + 0.01 * s, 0.4 + 0.008 * s, 0.6, k % 2, 1 - (k % 2)]);
      if (k > 0 && k % 250 === 0) {
        const marker = nearest(this.plan.nodes, e, n);
        visits.push({
          session_id: "s9",
          marker: marker.name,
          id: `v${k}`,
          t_start_ns: t_s * 1e9,
          t_end_ns: (t_s + 5) * 1e9,
          t_applied_ns: (t_s + 2.5) * 1e9,
          accepted: k !== 1250,
          nis: 1.1 + (k % 7),
          before_minus_marker_m: [e + since[0] - marker.e_m, n + since[1] - marker.n_m, 0.1],
          reason: k === 1250 ? "NIS 31.2 is beyond 13.8" : "",
        });
        if (k !== 1250) drift = off;
      }
    }
    const stands = visits.slice(0, 2).map((visit, i) => ({
      number: i + 1,
      t_start_ns: visit.t_start_ns - 1e9,
      t_end_ns: visit.t_end_ns + 1e9,
      lasts: false,
      position_m: [0, 0, 0],
      candidates: [
        { marker: visit.marker, probability: 0.97, distance_m: 1.1 },
        { marker: null, probability: 0.03, distance_m: null },
      ],
    }));
    stands.push({
      number: 3,
      t_start_ns: 40e9,
      t_end_ns: 52e9,
      lasts: false,
      position_m: [0, 0, 0],
      candidates: [
        { marker: "A17", probability: 0.62, distance_m: 2.4 },
        { marker: "A18", probability: 0.3, distance_m: 7.9 },
        { marker: null, probability: 0.08, distance_m: null },
      ],
    });
    const report = {
      aids: [
        {
          aid: "zupt",
          accepted: 12840,
          rejected: 0,
          unusable: 0,
          accepted_degrees: 38520,
          mean_nis_per_degree: 0.41,
          bounds_95: [0.986, 1.014],
        },
        {
          aid: "heading",
          accepted: 1422,
          rejected: 61,
          unusable: 12,
          accepted_degrees: 1422,
          mean_nis_per_degree: 1.02,
          bounds_95: [0.928, 1.075],
        },
        {
          aid: "separation",
          accepted: 1390,
          rejected: 8,
          unusable: 0,
          accepted_degrees: 1390,
          mean_nis_per_degree: 1.31,
          bounds_95: [0.927, 1.076],
        },
      ],
      visit_errors: null,
      rejected_visits: [],
      closure: { end_error_m: 1.24, end_error_percent: 0.11, height_error_m: 0.4, path_m: 1120 },
      sigma_plan_m: { count: 9000, mean_m: 1.0, rms_m: 1.1, std_m: 0.2, max_m: 1.9, p95_m: 1.6 },
      end_sigma_plan_m: 1.2,
      end_sigma_up_m: 0.5,
      stance_share: [0.61, null],
    };
    return {
      report,
      stands,
      main: { run: "main", columns, rows: main },
      without_markers: { run: "without_markers", columns, rows: without },
      visits,
    };
  }
}

export function nearest(nodes, e, n) {
  return nodes.reduce((best, node) =>
    Math.hypot(node.e_m - e, node.n_m - n) < Math.hypot(best.e_m - e, best.n_m - n) ? node : best,
  );
}

export function fault(id, inspector_id, kind, severity, position_m, candidates) {
  return {
    id,
    inspector_id,
    session_id: null,
    kind,
    severity,
    text: "",
    marker: null,
    state: "open",
    assignee_id: null,
    photos: 0,
    version: 1,
    reported_at: iso(-300_000),
    closed_at: null,
    position_m,
    sigma_m: [1.8, 1.6, 0.7],
    candidates: candidates.map(([marker, probability, distance_m]) => ({ marker, probability, distance_m })),
  };
}

/** @param {number} offset_ms from now */
export function iso(offset_ms) {
  return new Date(Date.now() + offset_ms).toISOString();
}
