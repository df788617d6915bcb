// What every list of the administration does with a button: try, say why it could not, show what is so then.

import { html, render } from "../html.js";
import { problemBox } from "../ui/problem.js";

/**
 * @param {HTMLElement} answer where it is said
 * @param {() => unknown} show
 * @param {() => void} [refused] what else is done then
 */
export function makeAttempt(answer, show, refused) {
  return async (/** @type {() => Promise<unknown>} */ run) => {
    render(answer, html``);
    try {
      await run();
    } catch (error) {
      render(answer, problemBox(error));
      refused?.();
    }
    await show();
  };
}
