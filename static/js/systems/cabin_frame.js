// A frame of a live session's poses, as docs/poses.md lays it out.

const HEAD_BYTES = 40;
const BODY_BYTES = 132;
const AID_BYTES = 4;
/** An aid that has not corrected for so long, hundredths of a second, may never have. */
const LONG_AGO = 65535;

/**
 * @typedef {{
 *   place_m: number[], angles_rad: number[], sigma_m: number[], sigma_rad: number[], off_m: number[], off_rad: number[],
 *   level_m: number, left_s: number, valid: boolean, measured: boolean, alarm: boolean, near: boolean,
 * }} Body
 * @typedef {{since_s: number, trouble: number}} Aid the number of its trouble; 0 where nothing is wrong
 * @typedef {{t_s: number, age_s: number, state: number, aids: bigint, bodies: (Body | null)[], states: Aid[]}} Frame
 */

/** Bytes of a frame with two bodies. @param {number} aids */
export const frameBytes = (aids) => HEAD_BYTES + 2 * BODY_BYTES + aids * AID_BYTES;

/**
 * @param {ArrayBuffer} bytes
 * @returns {Frame | null} null for what is no frame
 */
export function readFrame(bytes) {
  const view = new DataView(bytes);
  if (bytes.byteLength < HEAD_BYTES || view.getUint32(0) !== 0x4c504f53 || view.getUint16(4, true) !== 2) return null;
  const aids = view.getUint8(31);
  if (view.getUint8(30) !== 2 || bytes.byteLength !== frameBytes(aids)) return null;
  return {
    t_s: Number(view.getBigInt64(16, true)) / 1e9,
    age_s: view.getUint32(24, true) / 1e6,
    state: view.getUint8(28),
    aids: view.getBigUint64(32, true),
    bodies: [0, 1].map((k) => readBody(view, HEAD_BYTES + k * BODY_BYTES)),
    states: Array.from({ length: aids }, (_, k) => readAid(view, frameBytes(k))),
  };
}

/**
 * @param {DataView} view
 * @param {number} at
 * @returns {Aid}
 */
function readAid(view, at) {
  const since = view.getUint16(at, true);
  return { since_s: since === LONG_AGO ? Infinity : since / 100, trouble: view.getUint16(at + 2, true) };
}

/**
 * @param {DataView} view
 * @param {number} at
 * @returns {Body | null}
 */
function readBody(view, at) {
  const flags = view.getUint32(at + 128, true);
  const doubles = (/** @type {number} */ from) => [0, 8, 16].map((k) => view.getFloat64(at + from + k, true));
  const floats = (/** @type {number} */ from) => [0, 4, 8].map((k) => view.getFloat32(at + from + k, true));
  if (!(flags & 1)) return null;
  return {
    place_m: doubles(0),
    angles_rad: doubles(24),
    sigma_m: floats(72),
    sigma_rad: floats(84),
    off_m: floats(96),
    off_rad: floats(108),
    level_m: view.getFloat32(at + 120, true),
    left_s: view.getFloat32(at + 124, true),
    measured: Boolean(flags & 2),
    valid: Boolean(flags & 4),
    alarm: Boolean(flags & 8),
    near: Boolean(flags & 16),
  };
}
