// People so close together that their signs would hide each other: one sign with a count stands for them, and fans out when it is asked.

/** Signs nearer than this hide each other, pixels. */
export const CLOSE_PX = 16;
/** Between neighbours of a fan, pixels. */
const APART_PX = 46;
const FIRST_RING_PX = 44;

/**
 * Groups of those who are close to the first of their group, in the order in which they come.
 * @template T
 * @param {T[]} list the first of a group stands for it
 * @param {(one: T) => [number, number]} place pixels
 * @returns {T[][]}
 */
export function crowds(list, place) {
  /** By squares as wide as the reach, those who stand for a group. @type {Map<string, {x: number, y: number, group: T[]}[]>} */
  const squares = new Map();
  const groups = [];
  for (const one of list) {
    const [x, y] = place(one);
    const [column, row] = [Math.floor(x / CLOSE_PX), Math.floor(y / CLOSE_PX)];
    const found = near(squares, column, row).find((head) => Math.hypot(head.x - x, head.y - y) < CLOSE_PX);
    if (found) {
      found.group.push(one);
      continue;
    }
    const head = { x, y, group: [one] };
    groups.push(head.group);
    const key = `${column} ${row}`;
    squares.set(key, [...(squares.get(key) ?? []), head]);
  }
  return groups;
}

/**
 * @template H
 * @param {Map<string, H[]>} squares
 * @param {number} column
 * @param {number} row
 */
function near(squares, column, row) {
  /** @type {H[]} */
  const found = [];
  for (let c = column - 1; c <= column + 1; c++) {
    for (let r = row - 1; r <= row + 1; r++) found.push(...(squares.get(`${c} ${r}`) ?? []));
  }
  return found;
}

/**
 * Where the signs of a group stand when it is fanned out, from its middle: rings that each hold as many as have room.
 * @param {number} n
 * @returns {[number, number][]} pixels, right and down
 */
export function fan(n) {
  /** @type {[number, number][]} */
  const places = [];
  for (let ring_px = FIRST_RING_PX; places.length < n; ring_px += APART_PX) {
    const room = Math.floor((2 * Math.PI * ring_px) / APART_PX);
    const here = Math.min(room, n - places.length);
    for (let i = 0; i < here; i++) {
      const angle = (2 * Math.PI * i) / here - Math.PI / 2;
      places.push([Math.round(ring_px * Math.cos(angle)), Math.round(ring_px * Math.sin(angle))]);
    }
  }
  return places;
}
