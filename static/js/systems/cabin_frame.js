// A frame of a live session's poses, as docs/poses.md lays it out.

export const FRAME_BYTES = 280;
const HEAD_BYTES = 40;
const BODY_BYTES = 120;

/**
 * @typedef {{
 *   place_m: number[], angles_rad: number[], sigma_m: number[], off_m: number[], level_m: number, left_s: number,
 *   valid: boolean, measured: boolean, alarm: boolean, near: boolean,
 * }} Body
 * @typedef {{t_s: number, age_s: number, state: number, aids: bigint, bodies: (Body | null)[]}} Frame
 */

/**
 * @param {ArrayBuffer} bytes
 * @returns {Frame | null} null for what is no frame
 */
export function readFrame(bytes) {
  const view = new DataView(bytes);
  if (bytes.byteLength !== FRAME_BYTES || view.getUint32(0) !== 0x4c504f53 || view.getUint16(4, true) !== 1)
    return null;
  return {
    t_s: Number(view.getBigInt64(16, true)) / 1e9,
    age_s: view.getUint32(24, true) / 1e6,
    state: view.getUint8(28),
    aids: view.getBigUint64(32, true),
    bodies: [0, 1].map((k) => readBody(view, HEAD_BYTES + k * BODY_BYTES)),
  };
}

/**
 * @param {DataView} view
 * @param {number} at
 * @returns {Body | null}
 */
function readBody(view, at) {
  const flags = view.getUint32(at + 116, true);
  const doubles = (/** @type {number} */ from) => [0, 8, 16].map((k) => view.getFloat64(at + from + k, true));
  const floats = (/** @type {number} */ from) => [0, 4, 8].map((k) => view.getFloat32(at + from + k, true));
  if (!(flags & 1)) return null;
  return {
    place_m: doubles(0),
    angles_rad: doubles(24),
    sigma_m: floats(72),
    off_m: floats(96),
    level_m: view.getFloat32(at + 108, true),
    left_s: view.getFloat32(at + 112, true),
    measured: Boolean(flags & 2),
    valid: Boolean(flags & 4),
    alarm: Boolean(flags & 8),
    near: Boolean(flags & 16),
  };
}
