// Keyboard shortcuts of a replay.

import { CAMERAS, type Camera } from "../replay/fragment";

/** What keys can do. */
export interface KeyActions {
  readonly toggle: () => void;
  readonly step: (steps: number) => void;
  readonly event: (direction: 1 | -1) => void;
  readonly camera: (camera: Camera) => void;
  readonly flat: () => void;
  readonly help: () => void;
}

/**
 * The action of a key; null without one. `focus`: the focused control. Keys that the control itself needs are left to it:
 * arrows of a slider, space of a button, all keys of a text field.
 */
export function actionFor(
  key: string,
  shift: boolean,
  focus: "picture" | "slider" | "button" | "other",
  actions: KeyActions,
): (() => void) | null {
  if (focus === "other") return null;
  const camera = CAMERAS[Number(key) - 1] as Camera | undefined;
  if (camera !== undefined) return () => { actions.camera(camera); }; // prettier-ignore
  const stepAction = (count: number): (() => void) => () => { actions.step(count); }; // prettier-ignore
  switch (key) {
    case " ":
      return focus === "button" ? null : actions.toggle;
    case "ArrowLeft":
    case "ArrowRight": {
      const signedStep = key === "ArrowLeft" ? -1 : 1;
      if (shift) return stepAction(10 * signedStep);
      return focus === "slider" ? null : stepAction(signedStep);
    }
    case "Home":
    case "End":
      return focus === "slider" ? null : stepAction(key === "Home" ? -Infinity : Infinity);
    case ",":
      return stepAction(-1);
    case ".":
      return stepAction(1);
    case "n":
      return () => { actions.event(1); }; // prettier-ignore
    case "p":
      return () => { actions.event(-1); }; // prettier-ignore
    case "f":
      return actions.flat;
    case "?":
      return actions.help;
    default:
      return null;
  }
}

/** Listens inside the viewer only: elsewhere on the page the keys belong to the browser. */
export function listenForKeys(element: HTMLElement, actions: KeyActions): void {
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const action = actionFor(event.key, event.shiftKey, focusOf(event.target), actions);
    if (action === null) return;
    event.preventDefault();
    action();
  });
}

function focusOf(target: EventTarget | null): "picture" | "slider" | "button" | "other" {
  if (!(target instanceof HTMLElement)) return "other";
  if (target.closest("dialog") !== null) return "other";
  if (target instanceof HTMLInputElement) {
    return target.type === "range" ? "slider" : target.type === "checkbox" ? "button" : "other";
  }
  if (target.closest("button, summary, a") !== null) return "button";
  return target.classList.contains("canvas-area") ? "picture" : "other";
}
