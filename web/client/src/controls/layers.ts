// Checkboxes for the paths that are drawn.

import type { Layers } from "../replay/frame-state";
import { h } from "./dom";

interface Choice {
  readonly layer: Exclude<keyof Layers, "wholePart">;
  readonly name: string;
  /** CSS class of a line sample in the style of the picture. */
  readonly sample: string;
}

const CHOICES: readonly Choice[] = [
  { layer: "puck", name: "Puck’s path", sample: "trail" },
  { layer: "mallet", name: "Mallet’s path", sample: "real" },
  { layer: "commanded", name: "Commanded path", sample: "commanded" },
  { layer: "seen", name: "Observed puck", sample: "seen" },
];

/** Choice of drawn paths. */
export class LayerChoice {
  readonly element: HTMLElement;
  private readonly rows = new Map<keyof Layers, HTMLElement>();
  private readonly boxes = new Map<Choice["layer"], HTMLInputElement>();
  private readonly trail = h("select", {}, h("option", {}, "last second"), h("option", {}, "everything"));

  constructor(
    private readonly layers: Layers,
    private readonly changed: () => void,
  ) {
    const rows = CHOICES.map(({ layer, name, sample }) => {
      const box = h("input", { attributes: { type: "checkbox" } });
      box.checked = layers[layer];
      box.addEventListener("change", () => {
        layers[layer] = box.checked;
        changed();
      });
      const row = h("label", {}, box, h("span", { class: `line-sample ${sample}` }), name);
      this.rows.set(layer, row);
      this.boxes.set(layer, box);
      return row;
    });
    this.trail.addEventListener("change", () => {
      layers.wholePart = this.trail.selectedIndex === 1;
      changed();
    });
    this.element = h(
      "div",
      { class: "row layers", attributes: { role: "group", "aria-label": "Paths" } },
      ...rows,
      h("label", {}, "Trail: ", this.trail),
    );
  }

  /** Shows the layers of a link. */
  set(layers: Layers): void {
    Object.assign(this.layers, layers);
    for (const [layer, box] of this.boxes) box.checked = layers[layer];
    this.trail.selectedIndex = layers.wholePart ? 1 : 0;
    this.changed();
  }

  /** Hides choices without data. */
  update(available: { seen: boolean; commanded: boolean }): void {
    const seen = this.rows.get("seen");
    const commanded = this.rows.get("commanded");
    if (seen !== undefined) seen.hidden = !available.seen;
    if (commanded !== undefined) commanded.hidden = !available.commanded;
  }
}
