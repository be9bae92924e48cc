import { CAMERAS, type Camera } from "../replay/fragment";

export interface KeyActions {
  readonly toggle: () => void;
  readonly step: (by: number) => void;
  readonly event: (direction: 1 | -1) => void;
  readonly camera: (camera: Camera) => void;
  readonly flat: () => void;
  readonly help: () => void;
}

/**
 * The action of a key; null without one. `on`: the focused control. Keys that the control itself needs are left to it:
 * arrows of a slider, space of a button, all keys of a text field.
 */
export function actionFor(
  key: string,
  shift: boolean,
  on: "picture" | "slider" | "button" | "other",
  actions: KeyActions,
): (() => void) | null {
  if (on === "other") return null;
  const camera = CAMERAS[Number(key) - 1] as Camera | undefined;
  if (camera !== undefined) return () => { actions.camera(camera); }; // prettier-ignore
  const steps = (by: number): (() => void) => () => { actions.step(by); }; // prettier-ignore
  switch (key) {
    case " ":
      return on === "button" ? null : actions.toggle;
    case "ArrowLeft":
    case "ArrowRight": {
      const by = key === "ArrowLeft" ? -1 : 1;
      if (shift) return steps(10 * by);
      return on === "slider" ? null : steps(by);
    }
    case "Home":
    case "End":
      return on === "slider" ? null : steps(key === "Home" ? -Infinity : Infinity);
    case ",":
      return steps(-1);
    case ".":
      return steps(1);
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
  return target.classList.contains("stage") ? "picture" : "other";
}
