// All strip charts below the picture.

import { h } from "../controls/dom";
import { timeText } from "../controls/format";
import { sideName, type SideNames } from "../replay/events";
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
  private wantedArm: 0 | 1 = 0;

  constructor(
    private readonly names: SideNames,
    private readonly seek: (sample: number) => void,
  ) {
    this.choice.addEventListener("change", () => {
      this.wantedArm = this.choice.selectedIndex === 1 ? 1 : 0;
      this.rebuild();
    });
    this.element = h(
      "div",
      { class: "strips", attributes: { role: "group", "aria-label": "Values over time" } },
      h(
        "div",
        { class: "row" },
        h("h2", { class: "heading" }, "Margins and times"),
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
    const arms = part.motion.arms.map((_, side) => h("option", {}, this.armName(part, side === 0 ? 0 : 1)));
    this.choice.replaceChildren(...arms);
    this.choice.selectedIndex = Math.min(this.wantedArm, arms.length - 1);
    this.choiceRow.hidden = arms.length < 2;
    const { first, samples, stepS, contest } = part.motion;
    const format = { stepS, hasMinutes: contest === "game" };
    const to = timeText(first + samples - 1, format);
    this.span.textContent = contest === "game" ? `${timeText(first, format)} to ${to}` : "";
    this.rebuild();
  }

  /** The arm whose values are shown. */
  get arm(): 0 | 1 {
    return this.wantedArm;
  }

  setArm(arm: 0 | 1): void {
    this.wantedArm = arm;
    this.choice.selectedIndex = Math.min(arm, this.choice.length - 1);
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

  private armName({ motion }: ReplayPart, side: 0 | 1): string {
    const name = sideName(motion, side, this.names);
    return motion.contest === "game" ? `${name} (${side === 0 ? "left" : "right"})` : name;
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
