// Buttons to share a replay: link, picture, full screen; and help.

import { button, h } from "./dom";
import { ICONS } from "./icons";

interface Actions {
  /** Address of the current moment and view. */
  readonly link: () => string;
  readonly save: () => void;
  readonly help: () => void;
  readonly announce: (text: string) => void;
}

/** Buttons for link, picture, full screen and help. `full`: element shown in full screen. */
export function shareRow(full: HTMLElement, actions: Actions): HTMLElement {
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
  const row = h("div", { class: "row share" }, copy, address, button("Save picture", actions.save));
  if (document.fullscreenEnabled) {
    const screen = button("Full screen", () => {
      void (document.fullscreenElement === null ? full.requestFullscreen() : document.exitFullscreen());
    }, ICONS.full); // prettier-ignore
    row.append(screen);
  }
  const help = button("?", actions.help);
  help.setAttribute("aria-label", "Keys");
  help.title = "Keys";
  help.classList.add("icon-button");
  row.append(help);
  return row;
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
