// The help dialog.

import { button, h } from "./dom";

const SHORTCUTS: readonly [keys: string, what: string][] = [
  ["Space", "play, pause"],
  ["← →", "one step back, forward"],
  ["Shift + ← →", "ten steps"],
  [", .", "one step back, forward"],
  ["Home, End", "to the start, to the end"],
  ["p, n", "previous, next event"],
  ["1 2 3 4", "camera: corner, side, robot’s view, above"],
  ["f", "flat view, 3-D"],
  ["?", "this help"],
];

/** Dialog with the keyboard shortcuts. */
export function helpDialog(): HTMLDialogElement {
  const rows = SHORTCUTS.map(([keys, what]) =>
    h("div", {}, h("dt", {}, h("kbd", {}, keys)), h("dd", {}, what)),
  );
  const close = button("Close", () => {
    dialog.close();
  });
  const dialog = h(
    "dialog",
    { class: "help", attributes: { "aria-label": "Keys of the replay" } },
    h("h2", {}, "Keys"),
    h("p", {}, "Click the picture (or tab to it) first."),
    h("dl", {}, ...rows),
    h(
      "p",
      {},
      "Drag the picture to turn the camera; use Ctrl and the mouse wheel to zoom. Click or drag in a chart to go to that time.",
    ),
    close,
  );
  return dialog;
}
