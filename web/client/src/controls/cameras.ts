// Buttons for the view (3-D or flat) and the camera.

import { CAMERAS, type Camera } from "../replay/fragment";
import { button, h } from "./dom";
import { ICONS } from "./icons";

const CAMERA_NAMES: Record<Camera, string> = {
  corner: "Corner",
  side: "Side",
  robot: "Robot’s view",
  above: "Above",
  follow: "Follow puck",
};

export interface CameraActions {
  readonly preset: (camera: Camera) => void;
  /** Turns the camera by a number of small turns. */
  readonly orbit: (right: number, up: number) => void;
  readonly zoom: (steps: number) => void;
  readonly flat: (flat: boolean) => void;
}

/** Choice of view and camera. The buttons offer everything that dragging does. */
export class Cameras {
  readonly element: HTMLElement;
  private readonly button3d: HTMLButtonElement;
  private readonly buttonFlat: HTMLButtonElement;
  private readonly presets = new Map<Camera, HTMLButtonElement>();
  private readonly orbitButtons: HTMLElement;
  private readonly presetButtons: HTMLElement;

  constructor(actions: CameraActions) {
    this.button3d = button("3-D", () => { actions.flat(false); }); // prettier-ignore
    this.buttonFlat = button("Flat", () => { actions.flat(true); }); // prettier-ignore
    for (const camera of CAMERAS) {
      this.presets.set(camera, button(CAMERA_NAMES[camera], () => { actions.preset(camera); })); // prettier-ignore
    }
    const turn = (name: string, right: number, up: number, iconPath: string): HTMLButtonElement =>
      button(name, () => { actions.orbit(right, up); }, iconPath); // prettier-ignore
    this.presetButtons = h(
      "span",
      { class: "button-group", attributes: { role: "group", "aria-label": "Camera" } },
      ...this.presets.values(),
    );
    this.orbitButtons = h(
      "span",
      { class: "button-group", attributes: { role: "group", "aria-label": "Turn the camera" } },
      h("span", { class: "button-name" }, "Turn"),
      turn("Turn left", -1, 0, ICONS.left),
      turn("Turn right", 1, 0, ICONS.right),
      turn("Turn up", 0, 1, ICONS.up),
      turn("Turn down", 0, -1, ICONS.down),
      h("span", { class: "button-name" }, "Zoom"),
      button("Zoom in", () => { actions.zoom(1); }, ICONS.closer),
      button("Zoom out", () => { actions.zoom(-1); }, ICONS.farther),
    ); // prettier-ignore
    this.element = h(
      "div",
      { class: "row cameras" },
      h(
        "span",
        { class: "button-group", attributes: { role: "group", "aria-label": "View" } },
        this.button3d,
        this.buttonFlat,
      ),
      this.presetButtons,
      this.orbitButtons,
    );
  }

  /** `camera`: null if turned manually. */
  update(flat: boolean, camera: Camera | null, is3dAvailable: boolean): void {
    setPressed(this.button3d, !flat);
    setPressed(this.buttonFlat, flat);
    this.button3d.disabled = !is3dAvailable;
    for (const [name, element] of this.presets) setPressed(element, !flat && name === camera);
    this.presetButtons.hidden = flat;
    this.orbitButtons.hidden = flat;
  }
}

function setPressed(element: HTMLElement, pressed: boolean): void {
  element.setAttribute("aria-pressed", String(pressed));
}
