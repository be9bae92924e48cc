// The help dialog.

import { button, h } from "./dom";

const PICTURE_SHORTCUTS: readonly [keys: string, what: string][] = [
  ["← →", "one step back, forward"],
  ["Shift + ← →", "ten steps"],
  [", .", "one step back, forward"],
  ["Home, End", "to the start, to the end"],
  ["p, n", "previous, next event"],
  ["1 2 3 4 5", "camera: corner, side, robot’s view, above, follow puck"],
  ["f", "flat view, 3-D"],
  ["?", "this help"],
];

/** Dialog with the keyboard shortcuts. */
export function helpDialog(): HTMLDialogElement {
  const list = (shortcuts: readonly [string, string][]): HTMLElement => {
    const rows = shortcuts.map(([keys, what]) =>
      h("div", {}, h("dt", {}, h("kbd", {}, keys)), h("dd", {}, what)),
    );
    return h("dl", {}, ...rows);
  };
  const close = button("Close", () => {
    dialog.close();
  });
  const dialog = h(
    "dialog",
    { class: "help", attributes: { "aria-label": "Keys of the replay" } },
    h("h2", {}, "Keys"),
    list([["Space", "play, pause: everywhere on the page, except in what scrolls"]]),
    h("p", {}, "For the other keys, click the picture (or tab to it) first."),
    list(PICTURE_SHORTCUTS),
    h(
      "p",
      {},
      "Click the picture to play or pause. Drag it to turn the camera; use Ctrl and the mouse wheel to zoom; on a touch screen, turn, zoom and move it with two fingers. Click or drag in a chart to go to that time.",
    ),
    close,
  );
  return dialog;
}
