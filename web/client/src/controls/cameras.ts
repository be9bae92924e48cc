import { CAMERAS, type Camera } from "../replay/fragment";
import { button, h } from "./dom";
import { SIGNS } from "./signs";

const NAMES: Record<Camera, string> = {
  corner: "Corner",
  side: "Side",
  robot: "Robot’s view",
  above: "Above",
};

export interface CameraWishes {
  readonly preset: (camera: Camera) => void;
  /** Shares of a small turn. */
  readonly orbit: (right: number, up: number) => void;
  readonly closer: (steps: number) => void;
  readonly flat: (flat: boolean) => void;
}

/** Which view, from where: what dragging does can be done by buttons. */
export class Cameras {
  readonly element: HTMLElement;
  private readonly solid: HTMLButtonElement;
  private readonly flat: HTMLButtonElement;
  private readonly presets = new Map<Camera, HTMLButtonElement>();
  private readonly orbit: HTMLElement;
  private readonly places: HTMLElement;

  constructor(wishes: CameraWishes) {
    this.solid = button("3-D", () => { wishes.flat(false); }); // prettier-ignore
    this.flat = button("Flat", () => { wishes.flat(true); }); // prettier-ignore
    for (const camera of CAMERAS) {
      this.presets.set(camera, button(NAMES[camera], () => { wishes.preset(camera); })); // prettier-ignore
    }
    const turn = (name: string, right: number, up: number, sign: string): HTMLButtonElement =>
      button(name, () => { wishes.orbit(right, up); }, sign); // prettier-ignore
    this.places = h(
      "span",
      { class: "joined", attributes: { role: "group", "aria-label": "Camera" } },
      ...this.presets.values(),
    );
    this.orbit = h(
      "span",
      { class: "joined", attributes: { role: "group", "aria-label": "Turn the camera" } },
      turn("Turn left", -1, 0, SIGNS.left),
      turn("Turn right", 1, 0, SIGNS.right),
      turn("Higher", 0, 1, SIGNS.up),
      turn("Lower", 0, -1, SIGNS.down),
      button("Closer", () => { wishes.closer(1); }, SIGNS.closer),
      button("Farther", () => { wishes.closer(-1); }, SIGNS.farther),
    ); // prettier-ignore
    this.element = h(
      "div",
      { class: "row cameras" },
      h(
        "span",
        { class: "joined", attributes: { role: "group", "aria-label": "View" } },
        this.solid,
        this.flat,
      ),
      this.places,
      this.orbit,
    );
  }

  /** `camera` null: turned by hand. */
  update(flat: boolean, camera: Camera | null, solidPossible: boolean): void {
    press(this.solid, !flat);
    press(this.flat, flat);
    this.solid.disabled = !solidPossible;
    for (const [name, element] of this.presets) press(element, !flat && name === camera);
    this.places.hidden = flat;
    this.orbit.hidden = flat;
  }
}

function press(element: HTMLElement, pressed: boolean): void {
  element.setAttribute("aria-pressed", String(pressed));
}
