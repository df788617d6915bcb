// A pointer over a time axis: a press or a drag moves the cursor, with Shift it marks a stretch.

/**
 * @param {HTMLElement} el
 * @param {{timeAt: (px: number) => number, seek: (t_s: number) => void, select: (a_s: number, b_s: number) => void}} ways
 */
export function watchPointer(el, { timeAt, seek, select }) {
  /** @type {number | null} where a stretch was begun */
  let begun_s = null;
  const at_s = (/** @type {PointerEvent} */ event) => timeAt(event.clientX - el.getBoundingClientRect().left);
  el.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    el.setPointerCapture(event.pointerId);
    begun_s = event.shiftKey ? at_s(event) : null;
    if (begun_s === null) seek(at_s(event));
    // No text is marked on the way.
    event.preventDefault();
  });
  el.addEventListener("pointermove", (event) => {
    if (!el.hasPointerCapture(event.pointerId)) return;
    if (begun_s === null) seek(at_s(event));
    else select(begun_s, at_s(event));
  });
}
