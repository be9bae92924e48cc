// Drawing of a strip chart.

import type { Palette } from "../replay/palette";
import type { Series } from "./series";

/** Pattern of the limit's line: lengths of dash and gap, pixels. */
const DASHES = [4, 3];
/** The pattern of a line without gaps. */
const SOLID: number[] = [];
const PADDING_PX = 4;

/** Range of values to draw, including the limit. */
export function rangeOf(series: Series): [number, number] {
  let low = series.limit;
  let high = series.limit;
  for (const { values } of series.lines) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (series.allowed === "below") low = Math.min(low, 0);
  return high > low ? [low, high] : [low, low + 1];
}

/** Draws a chart in CSS pixels: forbidden range tinted, limit dashed, recorded violations as bars. */
export function plot(
  context: CanvasRenderingContext2D,
  width: number,
  height: number,
  series: Series,
  first: number,
  samples: number,
  palette: Palette,
): void {
  const [low, high] = rangeOf(series);
  const y = (value: number): number =>
    PADDING_PX + ((high - value) / (high - low)) * (height - 2 * PADDING_PX);
  const x = (k: number): number => (samples < 2 ? 0 : (k / (samples - 1)) * width);
  context.clearRect(0, 0, width, height);

  const limit = y(series.limit);
  context.fillStyle = palette.poor;
  context.globalAlpha = 0.1;
  if (series.allowed === "above") context.fillRect(0, limit, width, height - limit);
  else context.fillRect(0, 0, width, limit);
  context.globalAlpha = 0.28;
  for (const { from, to } of series.violations) {
    const left = x(from - first - 0.5);
    context.fillRect(left, 0, Math.max(x(to - first + 0.5) - left, 2), height);
  }
  context.globalAlpha = 1;

  context.strokeStyle = palette.poor;
  context.lineWidth = 1;
  context.setLineDash(DASHES);
  context.beginPath();
  context.moveTo(0, limit);
  context.lineTo(width, limit);
  context.stroke();
  context.setLineDash(SOLID);

  context.lineWidth = 1.5;
  context.lineJoin = "round";
  for (const line of series.lines) {
    context.strokeStyle = palette[line.colour];
    context.beginPath();
    let pen = false;
    line.values.forEach((value, k) => {
      if (Number.isNaN(value)) {
        pen = false;
      } else if (pen) {
        context.lineTo(x(k), y(value));
      } else {
        context.moveTo(x(k), y(value));
        pen = true;
      }
    });
    context.stroke();
  }
}
