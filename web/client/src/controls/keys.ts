import { CAMERAS, type Camera } from "../replay/fragment";

export interface KeyWishes {
  readonly toggle: () => void;
  readonly step: (by: number) => void;
  readonly event: (direction: 1 | -1) => void;
  readonly camera: (camera: Camera) => void;
  readonly flat: () => void;
  readonly help: () => void;
}

/**
 * What a key means. `on`: what has the focus. Keys that a control needs for itself are left to it: a slider its
 * arrows, a button its space bar, a field of text everything.
 */
export function wishOf(
  key: string,
  shift: boolean,
  on: "picture" | "slider" | "button" | "other",
  wishes: KeyWishes,
): (() => void) | null {
  if (on === "other") return null;
  const camera = CAMERAS[Number(key) - 1] as Camera | undefined;
  if (camera !== undefined) return () => { wishes.camera(camera); }; // prettier-ignore
  const steps = (by: number): (() => void) => () => { wishes.step(by); }; // prettier-ignore
  switch (key) {
    case " ":
      return on === "button" ? null : wishes.toggle;
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
      return () => { wishes.event(1); }; // prettier-ignore
    case "p":
      return () => { wishes.event(-1); }; // prettier-ignore
    case "f":
      return wishes.flat;
    case "?":
      return wishes.help;
    default:
      return null;
  }
}

/** Listens inside of a viewer only: elsewhere on the page the keys are the browser's. */
export function listenForKeys(element: HTMLElement, wishes: KeyWishes): void {
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const wish = wishOf(event.key, event.shiftKey, focusOf(event.target), wishes);
    if (wish === null) return;
    event.preventDefault();
    wish();
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
