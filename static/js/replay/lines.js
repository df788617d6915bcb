// The lines of charts as the server tells them: the smallest and largest value of each step in time.

/**
 * @typedef {{chart: string, series: string, start_s: number, step_s: number, low: (number | null)[], high?: (number | null)[]}} Line
 * @typedef {{chart: string, name: string, value: number}} Limit
 * @typedef {{from_s: number, to_s: number, limits: Limit[], series: Line[]}} Charts
 */

/**
 * The value at a moment: that of its own step, else the last one before, but not one that is long gone.
 * @param {Line | undefined} line
 * @param {number} t_s
 * @param {number} [longest_s] how old it may be
 * @returns {number | null} the middle between smallest and largest
 */
export function valueAt(line, t_s, longest_s = 3) {
  if (!line) return null;
  const high = line.high ?? line.low;
  let i = Math.min(line.low.length - 1, Math.floor((t_s - line.start_s) / line.step_s));
  for (; i >= 0 && t_s - (line.start_s + (i + 1) * line.step_s) <= longest_s; i--) {
    const [a, b] = [line.low[i], high[i]];
    if (a !== null && a !== undefined && b !== null && b !== undefined) return (a + b) / 2;
  }
  return null;
}

/**
 * Smallest and largest value in a stretch.
 * @param {Line} line
 * @param {number} from_s
 * @param {number} to_s
 * @returns {[number, number] | null}
 */
export function extremes(line, from_s, to_s) {
  const high = line.high ?? line.low;
  const first = Math.max(0, Math.floor((from_s - line.start_s) / line.step_s));
  const end = Math.min(line.low.length, Math.ceil((to_s - line.start_s) / line.step_s));
  let [least, most] = [Infinity, -Infinity];
  for (let i = first; i < end; i++) {
    const [a, b] = [line.low[i], high[i]];
    if (a !== null && a < least) least = a;
    if (b !== null && b > most) most = b;
  }
  return least <= most ? [least, most] : null;
}

/**
 * Round numbers between two values, three to six of them.
 * @param {number} least
 * @param {number} most
 * @returns {number[]}
 */
export function ticks(least, most) {
  const span = most - least;
  if (!(span > 0) || !Number.isFinite(span)) return [least];
  const rough = span / 4;
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * ([1, 2, 5, 10].find((k) => k * decade >= rough) ?? 10);
  const found = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most + step * 1e-9; k++)
    found.push(Number((k * step).toPrecision(12)));
  return found;
}

/**
 * Steps of time that people count in, s.
 * @param {number} span_s
 * @param {number} most how many marks there is room for
 */
export function timeStep(span_s, most) {
  return (
    [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400].find(
      (step) => span_s / step <= most,
    ) ?? 86400
  );
}

/**
 * A heading brought into [0, 360), as the read-out has it.
 * @param {number} degrees
 */
export function wrapDegrees(degrees) {
  return ((degrees % 360) + 360) % 360;
}
