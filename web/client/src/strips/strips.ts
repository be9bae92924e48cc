// All strip charts below the picture.

import { h } from "../controls/dom";
import { fixed } from "../controls/format";
import { sideName } from "../replay/events";
import type { Palette } from "../replay/palette";
import type { ReplayPart } from "../replay/source";
import { seriesOf } from "./series";
import { StripChart } from "./strip";

/** Charts below the picture for the current part; in a game for one side at a time. */
export class StripCharts {
  readonly element: HTMLElement;
  private readonly body = h("div");
  private readonly span = h("span", { class: "note" });
  private readonly choice = h("select");
  private readonly choiceRow = h("label", {}, "Arm ", this.choice);
  private strips: StripChart[] = [];
  private part: ReplayPart | null = null;
  private palette: Palette | null = null;
  private position = 0;

  constructor(private readonly seek: (sample: number) => void) {
    this.choice.addEventListener("change", () => {
      this.rebuild();
    });
    this.element = h(
      "div",
      { class: "strips", attributes: { role: "group", "aria-label": "Values over time" } },
      h(
        "div",
        { class: "row" },
        h("span", { class: "heading" }, "Margins and times"),
        this.span,
        this.choiceRow,
      ),
      h(
        "p",
        { class: "legend-note" },
        "Dashed: limit. Tinted: beyond the limit. Bars: recorded violations. Click or drag to go to a time.",
      ),
      this.body,
    );
    new ResizeObserver(() => {
      this.redraw();
    }).observe(this.body);
  }

  show(part: ReplayPart): void {
    if (part === this.part) return;
    this.part = part;
    const chosen = Math.max(this.choice.selectedIndex, 0);
    const arms = part.motion.arms.map((_, side) =>
      h("option", {}, sideName(part.motion, side === 0 ? 0 : 1)),
    );
    this.choice.replaceChildren(...arms);
    this.choice.selectedIndex = Math.min(chosen, arms.length - 1);
    this.choiceRow.hidden = arms.length < 2;
    const { first, samples, stepS, contest } = part.motion;
    const from = fixed(first * stepS, 1);
    const to = fixed((first + samples - 1) * stepS, 1);
    this.span.textContent = contest === "game" ? `this part: ${from} to ${to} s` : "";
    this.rebuild();
  }

  paint(palette: Palette): void {
    this.palette = palette;
    this.redraw();
  }

  update(position: number): void {
    this.position = position;
    for (const strip of this.strips) strip.update(position);
  }

  private rebuild(): void {
    const { part } = this;
    if (part === null) return;
    const { first, samples } = part.motion;
    this.strips = seriesOf(part, this.choice.selectedIndex === 1 ? 1 : 0).map(
      (series) => new StripChart(series, first, samples, this.seek),
    );
    this.body.replaceChildren(...this.strips.map((strip) => strip.element));
    this.redraw();
  }

  private redraw(): void {
    if (this.palette === null) return;
    for (const strip of this.strips) strip.draw(this.palette, Math.min(devicePixelRatio, 2));
    this.update(this.position);
  }
}
