import type { Contest } from "../clip/motion";
import { fixed } from "../controls/format";
import { MODEL } from "../model/model";
import { OUTER, rimOutline, successRegion } from "../model/table";
import type { Palette } from "../replay/palette";
import type { Projection } from "./projection";

const TICKS_X = [-0.8, -0.4, 0, 0.4, 0.8];
const TICKS_Y = [-0.4, -0.2, 0, 0.2, 0.4];
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", sans-serif';
const DASHES = [5, 4];
const SOLID: number[] = [];

/** Draws everything static. It is drawn once per size and colour scheme, then copied into each frame. */
export function drawTable(
  context: CanvasRenderingContext2D,
  at: Projection,
  palette: Palette,
  contest: Contest,
): void {
  context.fillStyle = palette["rp-backdrop"];
  context.fillRect(0, 0, at.width, at.height);
  context.fillStyle = palette["rp-table"];
  context.fillRect(at.x(-OUTER.x), at.y(OUTER.y), at.length(2 * OUTER.x), at.length(2 * OUTER.y));
  lines(context, at, palette);
  region(context, at, palette, contest);
  rims(context, at, palette);
  axes(context, at, palette);
}

function lines(context: CanvasRenderingContext2D, at: Projection, palette: Palette): void {
  const { half_length_m, half_width_m, goal_half_width_m } = MODEL.table;
  context.strokeStyle = palette["rp-mark"];
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(at.x(0), at.y(half_width_m));
  context.lineTo(at.x(0), at.y(-half_width_m));
  for (const x of [-half_length_m, half_length_m]) {
    context.moveTo(at.x(x), at.y(goal_half_width_m));
    context.lineTo(at.x(x), at.y(-goal_half_width_m));
  }
  context.stroke();
}

function region(context: CanvasRenderingContext2D, at: Projection, palette: Palette, contest: Contest): void {
  const place = successRegion(contest);
  if (place === null) return;
  const x = at.x(place.x_from_m);
  const width = at.length(place.x_to_m - place.x_from_m);
  const y = at.y(place.half_width_m);
  const height = at.length(2 * place.half_width_m);
  context.globalAlpha = 0.1;
  context.fillStyle = palette.good;
  context.fillRect(x, y, width, height);
  context.globalAlpha = 1;
  context.strokeStyle = palette.good;
  context.lineWidth = 1;
  context.setLineDash(DASHES);
  context.strokeRect(x, y, width, height);
  context.setLineDash(SOLID);
}

function rims(context: CanvasRenderingContext2D, at: Projection, palette: Palette): void {
  const outline = rimOutline();
  context.fillStyle = palette["rp-rim"];
  for (const mirror of [1, -1]) {
    context.beginPath();
    for (const [x, y] of outline) context.lineTo(at.x(x), at.y(mirror * y));
    context.closePath();
    context.fill();
  }
}

function axes(context: CanvasRenderingContext2D, at: Projection, palette: Palette): void {
  const left = at.x(-OUTER.x);
  const bottom = at.y(-OUTER.y);
  context.strokeStyle = palette.soft;
  context.fillStyle = palette.soft;
  context.lineWidth = 1;
  context.font = FONT;
  context.beginPath();
  for (const x of TICKS_X) {
    context.moveTo(at.x(x), bottom);
    context.lineTo(at.x(x), bottom + 5);
  }
  for (const y of TICKS_Y) {
    context.moveTo(left, at.y(y));
    context.lineTo(left - 5, at.y(y));
  }
  context.stroke();
  context.textAlign = "center";
  context.textBaseline = "top";
  // On a narrow picture neighbouring labels would overlap: show every second one.
  const everyX = at.length(0.4) < 44 ? 2 : 1;
  const everyY = at.length(0.2) < 18 ? 2 : 1;
  TICKS_X.forEach((x, i) => {
    if (i % everyX === 0) context.fillText(fixed(x, 1), at.x(x), bottom + 7);
  });
  context.fillText("x, m (table frame)", at.x(0), bottom + 22);
  context.textAlign = "right";
  context.textBaseline = "middle";
  TICKS_Y.forEach((y, i) => {
    if (i % everyY === 0) context.fillText(fixed(y, 1), left - 7, at.y(y));
  });
  context.fillText("y, m", left - 7, at.y(0.56));
}
