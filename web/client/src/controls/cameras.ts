import { CAMERAS, type Camera } from "../replay/fragment";
import { button, h } from "./dom";
import { ICONS } from "./icons";

const NAMES: Record<Camera, string> = {
  corner: "Corner",
  side: "Side",
  robot: "Robot’s view",
  above: "Above",
};

export interface CameraActions {
  readonly preset: (camera: Camera) => void;
  /** In units of a small turn. */
  readonly orbit: (right: number, up: number) => void;
  readonly closer: (steps: number) => void;
  readonly flat: (flat: boolean) => void;
}

/** Choice of view and camera. The buttons offer everything that dragging does. */
export class Cameras {
  readonly element: HTMLElement;
  private readonly solid: HTMLButtonElement;
  private readonly flat: HTMLButtonElement;
  private readonly presets = new Map<Camera, HTMLButtonElement>();
  private readonly orbit: HTMLElement;
  private readonly places: HTMLElement;

  constructor(actions: CameraActions) {
    this.solid = button("3-D", () => { actions.flat(false); }); // prettier-ignore
    this.flat = button("Flat", () => { actions.flat(true); }); // prettier-ignore
    for (const camera of CAMERAS) {
      this.presets.set(camera, button(NAMES[camera], () => { actions.preset(camera); })); // prettier-ignore
    }
    const turn = (name: string, right: number, up: number, iconPath: string): HTMLButtonElement =>
      button(name, () => { actions.orbit(right, up); }, iconPath); // prettier-ignore
    this.places = h(
      "span",
      { class: "joined", attributes: { role: "group", "aria-label": "Camera" } },
      ...this.presets.values(),
    );
    this.orbit = h(
      "span",
      { class: "joined", attributes: { role: "group", "aria-label": "Turn the camera" } },
      turn("Turn left", -1, 0, ICONS.left),
      turn("Turn right", 1, 0, ICONS.right),
      turn("Turn up", 0, 1, ICONS.up),
      turn("Turn down", 0, -1, ICONS.down),
      button("Zoom in", () => { actions.closer(1); }, ICONS.closer),
      button("Zoom out", () => { actions.closer(-1); }, ICONS.farther),
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

  /** `camera`: null if turned manually. */
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
