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

/** Where the focus is: on a control of the replay, elsewhere on the page, or where keys have another meaning. */
export type Focus = "picture" | "slider" | "button" | "page" | "other";

/**
 * The action of a key; null without one. Keys that the focused control itself needs are left to it: arrows of a slider, space of
 * a button, all keys of a text field. Elsewhere on the page only the space key is a shortcut: the others belong to the browser.
 */
export function actionFor(
  key: string,
  shift: boolean,
  focus: Focus,
  actions: KeyActions,
): (() => void) | null {
  if (focus === "other") return null;
  if (focus === "page") return key === " " && !shift ? actions.toggle : null;
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

/** Listens to the keys of a page. `isInside`: does an element belong to the replay? */
export function listenForKeys(isInside: (element: Element) => boolean, actions: KeyActions): void {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const { target } = event;
    if (!(target instanceof Element)) return;
    const action = actionFor(event.key, event.shiftKey, focusOf(target, isInside(target)), actions);
    if (action === null) return;
    event.preventDefault();
    // A held key does not switch again and again.
    if (event.repeat && event.key === " ") return;
    action();
  });
}

function focusOf(target: Element, isInside: boolean): Focus {
  if (target.closest("dialog") !== null) return "other";
  if (target instanceof HTMLInputElement) {
    if (!isInside) return "other";
    return target.type === "range" ? "slider" : target.type === "checkbox" ? "button" : "other";
  }
  if (target.closest("select, textarea, video, audio, iframe, [contenteditable]") !== null) return "other";
  if (target.closest("button, summary, a, label, [role=button]") !== null)
    return isInside ? "button" : "other";
  if (isInside && target.classList.contains("canvas-area")) return "picture";
  return isInScroller(target) ? "other" : "page";
}

/** Is an element in a part of the page with a scroll position of its own? There the keys scroll. */
function isInScroller(element: Element): boolean {
  for (let part: Element | null = element; part !== null; part = part.parentElement) {
    // These scroll the page, or all that is shown of it.
    if (part === document.body || part === document.fullscreenElement) return false;
    if (canScroll(part)) return true;
  }
  return false;
}

function canScroll(element: Element): boolean {
  const { overflowX, overflowY } = getComputedStyle(element);
  const scrolls = (overflow: string): boolean => overflow === "auto" || overflow === "scroll";
  // Sizes in whole pixels may differ by one without anything to scroll.
  return (
    (scrolls(overflowY) && element.scrollHeight > element.clientHeight + 1) ||
    (scrolls(overflowX) && element.scrollWidth > element.clientWidth + 1)
  );
}
