// A strip chart: a value over the samples of a part, with a cursor at the current sample.

import { h, setText } from "../controls/dom";
import { fixed } from "../controls/format";
import type { Palette } from "../replay/palette";
import { plot, rangeOf } from "./plot";
import type { Series } from "./series";

/** A small chart with the value at the cursor. */
export class StripChart {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", { attributes: { role: "img" } });
  private readonly cursor = h("span", { class: "cursor" });
  private readonly value = h("span", { class: "value" });
  private readonly field: HTMLElement;
  private width = 0;
  private shownSample = -1;

  constructor(
    private readonly series: Series,
    private readonly first: number,
    private readonly samples: number,
    seek: (sample: number) => void,
  ) {
    const [low, high] = rangeOf(series);
    const [lowest, highest] = [low, high].map((value) => `${fixed(value, series.digits)} ${series.unit}`);
    const scale = `from ${lowest} to ${highest}`;
    const limit = `limit ${fixed(series.limit, series.digits)} ${series.unit}`;
    const violations =
      series.violations.length === 0 ? "" : `; ${series.violations.length} violations recorded`;
    this.canvas.setAttribute("aria-label", `${series.title}, ${scale}, ${limit}${violations}`);
    this.field = h("div", { class: "field" }, this.canvas, this.cursor);
    this.element = h(
      "div",
      { class: "strip" },
      h("div", { class: "label" }, h("span", { class: "title" }, series.title), this.value),
      // The canvas says the same to screen readers.
      h(
        "div",
        { class: "scale", attributes: { "aria-hidden": "true" } },
        h("span", {}, highest),
        h("span", {}, lowest),
      ),
      this.field,
    );
    const follow = (event: PointerEvent): void => {
      const box = this.field.getBoundingClientRect();
      const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
      seek(first + Math.round(share * (samples - 1)));
    };
    this.field.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      this.field.setPointerCapture(event.pointerId);
      follow(event);
    });
    this.field.addEventListener("pointermove", (event) => {
      if (this.field.hasPointerCapture(event.pointerId)) follow(event);
    });
  }

  draw(palette: Palette, ratio: number): void {
    const { clientWidth: width, clientHeight: height } = this.field;
    this.width = width;
    this.canvas.width = Math.max(Math.round(width * ratio), 1);
    this.canvas.height = Math.max(Math.round(height * ratio), 1);
    const context = this.canvas.getContext("2d");
    if (context === null) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    plot(context, width, height, this.series, this.first, this.samples, palette);
  }

  update(position: number): void {
    const share = this.samples < 2 ? 0 : (position - this.first) / (this.samples - 1);
    const x = Math.min(Math.max(share, 0), 1) * this.width;
    this.cursor.style.transform = `translateX(${x.toFixed(1)}px)`;
    const k = Math.min(Math.max(Math.floor(position + 1e-6) - this.first, 0), this.samples - 1);
    if (k === this.shownSample) return;
    this.shownSample = k;
    setText(this.value, this.series.valueText(k));
  }
}
