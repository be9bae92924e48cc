// The switch that shows two replays on one table, and the legend of both.

import { h, setText } from "./dom";

/** A replay in the legend. */
export interface LegendEntry {
  /** Team and episode. */
  readonly title: string;
  /** How it ended, in words. */
  readonly outcome: string;
}

/** Draws the second of two replays on the table of the first. */
export class OneTable {
  readonly row: HTMLElement;
  readonly legend: HTMLElement;
  private readonly box = h("input", { attributes: { type: "checkbox", disabled: "" } });
  private readonly look = h("span");

  /** `switched` is called when the visitor uses the switch. */
  constructor(entries: readonly [LegendEntry, LegendEntry], switched: (isOn: boolean) => void) {
    this.box.addEventListener("change", () => {
      switched(this.box.checked);
    });
    this.row = h("div", { class: "row" }, h("label", {}, this.box, "Both on one table"));
    const [first, ghost] = entries.map(({ title, outcome }, i) =>
      h(
        "li",
        {},
        h("span", { class: i === 0 ? "swatch" : "swatch ghost" }),
        h(
          "span",
          {},
          h("strong", {}, title),
          i === 0 ? null : this.look,
          outcome === "" ? "" : `: ${outcome}`,
        ),
      ),
    );
    this.legend = h(
      "ul",
      { class: "table-legend", attributes: { "aria-label": "Replays on this table", hidden: "" } },
      first,
      ghost,
    );
  }

  get isOn(): boolean {
    return this.box.checked;
  }

  /** Are both replays loaded? Until then the switch cannot be used. */
  get isPossible(): boolean {
    return !this.box.disabled;
  }

  enable(isPossible: boolean): void {
    this.box.disabled = !isPossible;
  }

  show(isOn: boolean): void {
    this.box.checked = isOn;
    this.legend.hidden = !isOn;
  }

  /** Names how the second replay is drawn. */
  showLook(isFlat: boolean): void {
    setText(this.look, isFlat ? " (outlines)" : " (translucent)");
  }
}
