import { button, h } from "./dom";

const KEYS: readonly [keys: string, what: string][] = [
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

/** What the keys do, and what is drawn. */
export function helpDialog(): HTMLDialogElement {
  const rows = KEYS.map(([keys, what]) => h("div", {}, h("dt", {}, h("kbd", {}, keys)), h("dd", {}, what)));
  const close = button("Close", () => {
    dialog.close();
  });
  const dialog = h(
    "dialog",
    { class: "help", attributes: { "aria-label": "Keys of the replay" } },
    h("h2", {}, "Keys"),
    h(
      "p",
      {},
      "They work while the focus is in the replay: click the picture, or reach it with the tab key.",
    ),
    h("dl", {}, ...rows),
    h(
      "p",
      {},
      "Drag the picture to turn the camera; Ctrl and the wheel go closer. Click or drag in a strip to go to that time.",
    ),
    close,
  );
  return dialog;
}
