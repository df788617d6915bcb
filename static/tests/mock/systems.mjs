// A system that the page has no file for, as a server declares it.

/** @type {import("../../js/systems/generic.js").Declaration} */
export const RAFT = {
  name: "raft",
  title: "Raft",
  carrier_kind: "raft",
  streams: [
    { number: 0, name: "bow", role: "body", kind: "imu", least: 1, most: 1 },
    {
      number: 1,
      name: "range",
      role: "echo_sounder",
      kind: "values",
      least: 0,
      most: 1,
      columns: [
        { name: "t_s", unit: "s", required: true },
        { name: "depth_m", unit: "m", required: true },
        { name: "quality", unit: "1", required: false },
      ],
    },
  ],
  parts: [{ number: 0, name: "bow" }],
  aids: [{ name: "echo", title: "Echo sounder", degrees_of_freedom: 1, gate: 10.83 }],
  charts: [
    { name: "speed", unit: "m/s", lines: ["main"] },
    { name: "nis_echo", unit: "1", lines: ["accepted", "rejected"] },
    { name: "depth", unit: "m", lines: ["range"] },
  ],
  anomalies: [
    { kind: "gap", sentence: "Samples are missing." },
    { kind: "run_aground", sentence: "The raft does not move any more." },
  ],
};
