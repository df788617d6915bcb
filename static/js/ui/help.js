// What the keys do.

import { html } from "../html.js";
import { addWords, t } from "../i18n.js";
import { makeDialog } from "./dialog.js";

const KEYS = [
  ["F", "help.follow"],
  ["E", "help.ellipses"],
  ["T", "help.trails"],
  ["G", "help.go"],
  ["N", "help.next"],
  ["/", "help.search"],
  ["Space", "help.play"],
  ["← →", "help.step"],
  ["Alt ← →", "help.marker"],
  ["[ ]", "help.speed"],
  ["Home End", "help.ends"],
  ["A B", "help.loop"],
  ["L", "help.live"],
  ["Esc", "help.close"],
  ["?", "help.title"],
];

export function makeHelp() {
  const dialog = makeDialog("help");
  return {
    async show() {
      await addWords("help");
      dialog.open(
        html` <h2 id="help-title">${t("help.title")}</h2>
          <dl class="shortcuts">
            ${KEYS.map(
              ([key, words]) =>
                html`<dt><kbd>${key}</kbd></dt>
                  <dd>${t(words)}</dd>`,
            )}
          </dl>
          <p class="muted">${t("help.note")}</p>
          <div class="row end"><button type="button" data-close autofocus>${t("close")}</button></div>`,
      );
    },
  };
}
