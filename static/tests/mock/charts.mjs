// Charts for the mock's walk, as docs/wire.md has them: smooth curves with the extremes of each step.

/** Of each chart: its lines, and the value of the k-th of them at a time. @type {Record<string, [string[], (s: number, k: number) => number]>} */
const CHARTS = {
  speed: [["main"], (s) => 1.1 + 0.3 * Math.sin(s / 40)],
  gyro_norm: [["left", "right"], (s, k) => 3 + 2.5 * Math.sin(s * 5 + k * 3)],
  force_norm: [["left", "right"], (s, k) => 12 + 8 * Math.sin(s * 5 + k * 3)],
  rate: [["left", "right"], () => 100],
  stance: [["left", "right"], (s, k) => (Math.sin(s * 5 + k * 3) < 0 ? 1 : 0)],
  field: [["left", "right"], (s, k) => 48 + 6 * Math.sin(s / 25 + k) + 9 * Math.exp(-(((s - 600) / 20) ** 2))],
  heading: [["main", "filtered", "without_markers"], (s, k) => s / 60 + 0.05 * k * Math.sin(s / 100)],
  magnetic: [["left", "right"], (s, k) => 0.06 * Math.sin(s / 30 + k)],
  sigma_plan: [
    ["main", "filtered", "without_markers"],
    (s, k) => (k < 2 ? 0.5 + (0.01 + 0.006 * k) * (s % 125) : 0.5 + 0.006 * s),
  ],
  sigma_up: [["main", "filtered", "without_markers"], (s, k) => 0.3 + 0.0004 * s * (k + 1)],
  sigma_heading: [["main", "filtered", "without_markers"], (s, k) => 0.02 + 0.01 * k],
  separation: [["main"], (s) => 0.35 + 0.22 * Math.sin(s * 5)],
  height: [["main", "filtered", "without_markers"], (s, k) => -s / 60 + 0.4 * k],
  depth: [["range_1"], (s) => 4 + Math.sin(s / 50)],
  pressure_height: [["left", "right"], (s, k) => -s / 60 + 0.5 * Math.sin(s / 90 + k)],
};
for (const [aid, mean] of Object.entries({ zupt: 1.2, heading: 0.7, maru: 1.5, separation: 0.6, altimeter: 0.9 })) {
  CHARTS[`nis_${aid}`] = [
    ["accepted", "rejected"],
    (s, k) => (k === 0 ? mean * (1 + Math.sin(s * 1.7)) : Math.sin(s / 7) > 0.98 ? 14 : NaN),
  ];
}
for (const [chart, size] of Object.entries({ gyro_bias: 2e-4, accelerometer_bias: 0.03 })) {
  const axes = ["left", "right"].flatMap((foot) => ["x", "y", "z"].map((axis) => `${foot}_${axis}`));
  CHARTS[chart] = [axes, (s, k) => size * Math.sin(k * 2) * (1 - Math.exp(-s / 200))];
  CHARTS[`${chart}_sigma`] = [axes, (s) => size * (0.2 + Math.exp(-s / 150))];
}
const LIMITS = [
  ...["zupt", "heading", "maru", "separation", "altimeter"].map((aid) => ({
    chart: `nis_${aid}`,
    name: "expected_95",
    value: ["zupt", "maru"].includes(aid) ? 7.81 : 3.84,
  })),
  ...["heading", "maru", "separation", "altimeter"].map((aid) => ({
    chart: `nis_${aid}`,
    name: "gate",
    value: aid === "maru" ? 16.27 : 10.83,
  })),
  { chart: "field", name: "weakest", value: 40 },
  { chart: "field", name: "strongest", value: 60 },
  { chart: "separation", name: "usual", value: 0.13 },
];

/** @param {URLSearchParams} asked */
export function charts(asked) {
  const [from_s, to_s, buckets] = [
    Number(asked.get("from_s") ?? 0),
    Number(asked.get("to_s") ?? 1200),
    Number(asked.get("buckets") ?? 800),
  ];
  const wanted = (asked.get("charts") ?? "").split(",").filter(Boolean);
  const step_s = Math.max(0.1, (to_s - from_s) / buckets);
  const series = Object.entries(CHARTS)
    .filter(([chart]) => wanted.length === 0 || wanted.includes(chart))
    .flatMap(([chart, [names, value]]) =>
      names.map((name, k) => {
        const low = [];
        const high = [];
        for (let s = from_s; s < to_s; s += step_s) {
          const inside = [0, 0.2, 0.4, 0.6, 0.8].map((share) => value(s + share * step_s, k)).filter(Number.isFinite);
          const gap = s > 431 && s < 437;
          low.push(inside.length > 0 && !gap ? Math.min(...inside) : null);
          high.push(inside.length > 0 && !gap ? Math.max(...inside) : null);
        }
        return { chart, series: name, start_s: from_s, step_s, low, high };
      }),
    );
  return {
    from_s,
    to_s,
    limits: LIMITS.filter((limit) => wanted.length === 0 || wanted.includes(limit.chart)),
    series,
  };
}
