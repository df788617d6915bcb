// A grid index over the site's actuators: which are near a place, without asking all of them.

const CELL_M = 20;

/**
 * @template {{name: string, e_m: number, n_m: number}} Place
 */
export class SpatialIndex {
  /** @param {Place[]} places */
  constructor(places) {
    /** @type {Map<string, Place>} */
    this.byName = new Map(places.map((p) => [p.name.toUpperCase(), p]));
    /** @type {Map<string, Place[]>} */
    this.cells = new Map();
    for (const place of places) {
      const key = cellKey(Math.floor(place.e_m / CELL_M), Math.floor(place.n_m / CELL_M));
      const cell = this.cells.get(key);
      if (cell) cell.push(place);
      else this.cells.set(key, [place]);
    }
  }

  /** @param {string} name */
  named(name) {
    return this.byName.get(name.trim().toUpperCase());
  }

  /**
   * All places within a distance, nearest first.
   * @param {number} e_m
   * @param {number} n_m
   * @param {number} radius_m
   */
  within(e_m, n_m, radius_m) {
    /** @type {{place: Place, distance_m: number}[]} */
    const found = [];
    const low = [Math.floor((e_m - radius_m) / CELL_M), Math.floor((n_m - radius_m) / CELL_M)];
    const high = [Math.floor((e_m + radius_m) / CELL_M), Math.floor((n_m + radius_m) / CELL_M)];
    for (let i = low[0]; i <= high[0]; i++) {
      for (let j = low[1]; j <= high[1]; j++) {
        for (const place of this.cells.get(cellKey(i, j)) ?? []) {
          const distance_m = Math.hypot(place.e_m - e_m, place.n_m - n_m);
          if (distance_m <= radius_m) found.push({ place, distance_m });
        }
      }
    }
    return found.sort((a, b) => a.distance_m - b.distance_m);
  }

  /**
   * The n nearest places within a limit, nearest first.
   * @param {number} e_m
   * @param {number} n_m
   * @param {number} n
   * @param {number} limit_m
   */
  nearest(e_m, n_m, n = 1, limit_m = 160) {
    // Actuators stand about 10 m apart: the first ring nearly always answers.
    for (let radius_m = CELL_M; radius_m <= limit_m; radius_m *= 2) {
      const found = this.within(e_m, n_m, radius_m);
      if (found.length >= n) return found.slice(0, n);
    }
    return this.within(e_m, n_m, limit_m).slice(0, n);
  }
}

/**
 * @param {number} i
 * @param {number} j
 */
function cellKey(i, j) {
  return `${i}:${j}`;
}
