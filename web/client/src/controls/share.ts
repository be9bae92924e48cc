import { button, h } from "./dom";
import { SIGNS } from "./signs";

interface Wishes {
  /** The address of what is on show. */
  readonly link: () => string;
  readonly save: () => void;
  readonly help: () => void;
  readonly announce: (text: string) => void;
}

/** A link to here, the picture as a file, the whole screen, help. `full`: what fills the screen. */
export function shareRow(full: HTMLElement, wishes: Wishes): HTMLElement {
  const address = h("input", {
    class: "address",
    attributes: { readonly: "", "aria-label": "Link to here", hidden: "" },
  });
  const copy = button("Copy link here", () => {
    const link = wishes.link();
    copied(link).then(
      () => {
        wishes.announce("Link copied");
        flash(copy, "Link copied");
      },
      () => {
        // Where the clipboard is not to be had, the reader copies by hand.
        address.hidden = false;
        address.value = link;
        address.select();
        wishes.announce("The link is in the field beside the button");
      },
    );
  });
  const row = h("div", { class: "row share" }, copy, address, button("Save picture", wishes.save));
  if (document.fullscreenEnabled) {
    const screen = button("Whole screen", () => {
      void (document.fullscreenElement === null ? full.requestFullscreen() : document.exitFullscreen());
    }, SIGNS.full); // prettier-ignore
    row.append(screen);
  }
  const help = button("?", wishes.help);
  help.setAttribute("aria-label", "Keys");
  help.title = "Keys";
  help.classList.add("sign");
  row.append(help);
  return row;
}

async function copied(text: string): Promise<void> {
  // Absent outside of secure contexts, whatever the types say.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (clipboard === undefined) throw new Error("no clipboard");
  await clipboard.writeText(text);
}

function flash(element: HTMLElement, text: string): void {
  const before = element.dataset.name ?? element.textContent;
  element.dataset.name = before;
  element.textContent = text;
  setTimeout(() => {
    element.textContent = before;
  }, 2000);
}
