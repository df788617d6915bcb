// The keys of the replay. They come before those of the whole page, and leave alone what is typed and the
// arrows of a map that has the focus.

/**
 * @typedef {{
 *   toggle(): void, step(by_s: number): void, marker(by: number): void, speed(by: number): void,
 *   toStart(): void, toEnd(): void, live(): void, follow(): void, loopFrom(): void, loopTo(): void,
 * }} Replay
 */

/**
 * @param {Replay} replay
 * @returns {() => void} stops listening
 */
export function makeKeys(replay) {
  const listen = (/** @type {KeyboardEvent} */ event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.metaKey || document.querySelector("dialog[open]")) return;
    if (target.closest("textarea, select, input:not([type=checkbox])")) return;
    const run = action(event, target);
    if (!run) return;
    event.preventDefault();
    run();
  };
  addEventListener("keydown", listen, { capture: true });
  return () => removeEventListener("keydown", listen, { capture: true });

  /**
   * @param {KeyboardEvent} event
   * @param {HTMLElement} target
   * @returns {(() => void) | null}
   */
  function action(event, target) {
    const inMap = target.closest("#map") !== null;
    const by = event.key === "ArrowRight" ? 1 : -1;
    switch (event.key) {
      case "ArrowLeft":
      case "ArrowRight":
        if (event.altKey) return () => replay.marker(by);
        if (inMap || target.closest("[role=tab]")) return null;
        return () => replay.step(by * (event.shiftKey ? 1 : 0.1));
      default:
    }
    if (event.altKey) return null;
    switch (event.key) {
      // A button or a box that has the focus is what the space bar means.
      case " ":
        return target.closest("button, a, input, summary") ? null : () => replay.toggle();
      case "[":
        return () => replay.speed(-1);
      case "]":
        return () => replay.speed(1);
      case "Home":
        return () => replay.toStart();
      case "End":
        return () => replay.toEnd();
      case "l":
      case "L":
        return () => replay.live();
      case "f":
      case "F":
        return () => replay.follow();
      case "a":
      case "A":
        return () => replay.loopFrom();
      case "b":
      case "B":
        return () => replay.loopTo();
      default:
        return null;
    }
  }
}
