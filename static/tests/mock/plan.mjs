// A site for the mock server: the reflector's nodes as a geodesic dome, a spiral road, six towers.

const RADIUS_M = 300.4;
const SECTORS = ["A", "B", "C", "D", "E"];

export function makePlan() {
  const nodes = [{ name: "A0", sector: "A", e_m: 0, n_m: 0, u_m: 0 }];
  SECTORS.forEach((letter, i) => {
    const lattice = face(-36 + 72 * i);
    let number = 0;
    for (let r = 1; r <= 30; r++) {
      const [from, to, first] = r <= 28 ? [0, r - 1, (r * (r - 1)) / 2 + 1] : r === 29 ? [3, 26, 407] : [8, 22, 432];
      for (let j = from; j <= to; j++) {
        number = first + j - from;
        const [e_m, n_m, z] = lattice[r][j];
        nodes.push({ name: `${letter}${number}`, sector: letter, e_m, n_m, u_m: z + RADIUS_M });
      }
    }
  });
  const road = [];
  for (let i = 0; i <= 900; i++) {
    const turn = (i / 900) * 4.5 * 2 * Math.PI;
    const r = 20 + (220 * i) / 900;
    road.push([r * Math.sin(turn), r * Math.cos(turn)]);
  }
  return {
    nodes,
    ring_radius_m: 250,
    road,
    sectors: SECTORS.map((name, i) => ({ name, azimuth_deg: -36 + 72 * i })),
    towers: [1, 3, 5, 7, 9, 11].map((hour) => {
      const a = (hour * Math.PI) / 6;
      return { name: `${hour}H`, e_m: 290 * Math.sin(a), n_m: 290 * Math.cos(a) };
    }),
  };
}

/** One fifth of the dome: five rounds of edge bisection, each midpoint pushed back to the sphere. */
function face(azimuth_deg) {
  const size = 32;
  const lattice = Array.from({ length: size + 1 }, () => []);
  const polar = Math.acos(1 / Math.sqrt(5));
  const corner = (azimuth) => {
    const a = (azimuth * Math.PI) / 180;
    return [
      RADIUS_M * Math.sin(polar) * Math.sin(a),
      RADIUS_M * Math.sin(polar) * Math.cos(a),
      -RADIUS_M * Math.cos(polar),
    ];
  };
  lattice[0][0] = [0, 0, -RADIUS_M];
  lattice[size][0] = corner(azimuth_deg);
  lattice[size][size] = corner(azimuth_deg + 72);
  for (let h = size / 2; h >= 1; h /= 2) {
    for (let r = 0; r <= size; r += h) {
      for (let j = 0; j <= r; j += h) {
        if (lattice[r][j]) continue;
        const oddR = (r / h) % 2 === 1;
        const oddJ = (j / h) % 2 === 1;
        const [a, b] =
          oddR && oddJ
            ? [
                [r - h, j - h],
                [r + h, j + h],
              ]
            : oddR
              ? [
                  [r - h, j],
                  [r + h, j],
                ]
              : [
                  [r, j - h],
                  [r, j + h],
                ];
        lattice[r][j] = onSphere(lattice[a[0]][a[1]].map((v, k) => v + lattice[b[0]][b[1]][k]));
      }
    }
  }
  return lattice;
}

/** @param {number[]} v */
function onSphere(v) {
  const length = Math.hypot(...v);
  return v.map((x) => (x * RADIUS_M) / length);
}
