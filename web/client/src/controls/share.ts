// Buttons to share a replay: link, picture, video; and help.

import { button, h } from "./dom";
import { ICONS } from "./icons";

interface Actions {
  /** Address of the current moment and view. */
  readonly link: () => string;
  readonly save: () => void;
  /** Starts or stops recording a video; null if the browser cannot. */
  readonly record: (() => void) | null;
  readonly help: () => void;
  readonly announce: (text: string) => void;
}

/** The row of buttons below the picture, with what went wrong. */
export class ShareRow {
  readonly element: HTMLElement;
  private readonly video: HTMLButtonElement | null;
  private readonly problem = h("p", { class: "problem", attributes: { role: "alert", hidden: "" } });

  constructor(actions: Actions) {
    const address = h("input", {
      class: "address",
      attributes: { readonly: "", "aria-label": "Link to this moment", hidden: "" },
    });
    const copy = button("Copy link to this moment", () => {
      const link = actions.link();
      copyText(link).then(
        () => {
          actions.announce("Link copied");
          flash(copy, "Link copied");
        },
        () => {
          // Without access to the clipboard the visitor copies the link manually.
          address.hidden = false;
          address.value = link;
          address.select();
          actions.announce("Copy the link from the field beside the button");
        },
      );
    });
    this.video = actions.record === null ? null : button("", actions.record);
    this.showRecording(false);
    this.element = h(
      "div",
      { class: "row share" },
      copy,
      address,
      button("Save picture", actions.save),
      this.video,
      button("Keys", actions.help),
      this.problem,
    );
  }

  /** Shows why something could not be saved, until the next recording starts. */
  showProblem(text: string): void {
    this.problem.textContent = text;
    this.problem.hidden = false;
  }

  showRecording(isRecording: boolean): void {
    if (this.video === null) return;
    if (isRecording) this.problem.hidden = true;
    this.video.textContent = isRecording ? "Stop and save video" : "Record video";
    this.video.setAttribute("aria-pressed", String(isRecording));
  }
}

/** A button that shows an element in full screen; null if the browser cannot. */
export function fullScreenButton(full: () => HTMLElement): HTMLButtonElement | null {
  if (!document.fullscreenEnabled) return null;
  return button("Full screen", () => {
    void (document.fullscreenElement === null ? full().requestFullscreen() : document.exitFullscreen());
  }, ICONS.full); // prettier-ignore
}

/** Copies a text to the clipboard. */
async function copyText(text: string): Promise<void> {
  // Undefined outside secure contexts, contrary to its type.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (clipboard === undefined) throw new Error("no clipboard");
  await clipboard.writeText(text);
}

/** Shows another text on a button for two seconds. */
function flash(element: HTMLElement, text: string): void {
  const before = element.dataset.name ?? element.textContent;
  element.dataset.name = before;
  element.textContent = text;
  setTimeout(() => {
    element.textContent = before;
  }, 2000);
}
