// Checkboxes for the paths that are drawn.

import type { Layers } from "../replay/frame-state";
import { h } from "./dom";

interface Choice {
  readonly layer: Exclude<keyof Layers, "whole">;
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

  constructor(layers: Layers, changed: () => void) {
    const boxes = CHOICES.map(({ layer, name, sample }) => {
      const box = h("input", { attributes: { type: "checkbox" } });
      box.checked = layers[layer];
      box.addEventListener("change", () => {
        layers[layer] = box.checked;
        changed();
      });
      const row = h("label", {}, box, h("span", { class: `line-sample ${sample}` }), name);
      this.rows.set(layer, row);
      return row;
    });
    const trailChoice = h("select", {}, h("option", {}, "last second"), h("option", {}, "everything"));
    trailChoice.selectedIndex = layers.wholePart ? 1 : 0;
    trailChoice.addEventListener("change", () => {
      layers.wholePart = trailChoice.selectedIndex === 1;
      changed();
    });
    this.element = h(
      "div",
      { class: "row layers", attributes: { role: "group", "aria-label": "Paths" } },
      ...boxes,
      h("label", {}, "Trail: ", trailChoice),
    );
  }

  /** Hides choices without data. */
  update(available: { seen: boolean; commanded: boolean }): void {
    const seen = this.rows.get("seen");
    const commanded = this.rows.get("commanded");
    if (seen !== undefined) seen.hidden = !available.seen;
    if (commanded !== undefined) commanded.hidden = !available.commanded;
  }
}
