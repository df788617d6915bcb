// Systems as a server declares them: the first, which the page has a file for, and one that it has none for.

/** @typedef {import("../../js/systems/generic.js").Declaration} Declaration */

/** @type {Declaration} */
export const PEDESTRIAN = {
  name: "pedestrian",
  title: "A person with a sensor on each foot",
  carrier_kind: "person",
  streams: ["left", "right"].map((name) => ({
    name,
    role: `${name}_foot`,
    title: `The ${name} foot`,
    kind: "imu",
    columns: [],
    least: 0,
    most: 1,
  })),
  parts: ["left", "right"].map((name) => ({ name, title: `The ${name} foot` })),
  aids: [{ name: "zupt" }],
  charts: [],
  anomalies: ["gap"],
};

/** @type {Declaration} */
export const RAFT = {
  name: "raft",
  title: "Raft",
  carrier_kind: "raft",
  places_itself: true,
  streams: [
    { name: "bow", role: "body", title: "Sensor at the bow", kind: "imu", columns: [], least: 1, most: 1 },
    {
      name: "range",
      role: "echo_sounder",
      title: "Echo sounder",
      kind: "values",
      columns: [
        { name: "depth_m", required: true },
        { name: "quality", required: false },
      ],
      least: 0,
      most: 2,
    },
  ],
  parts: [{ name: "keel", title: "Keel" }],
  aids: [{ name: "echo" }, { name: "markers" }],
  charts: [
    { name: "speed", unit: "m/s" },
    { name: "depth", unit: "m" },
  ],
  anomalies: ["gap", "run_aground"],
};
