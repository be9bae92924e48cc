// The static parts of the flat view: table, lines, rims and axes.

import type { Contest } from "../clip/motion";
import { fixed } from "../controls/format";
import { MODEL } from "../model/model";
import { CENTRE_CIRCLE_RADIUS_M, OUTER_HALF_SIZE, roundedRimOutline, successRegion } from "../model/table";
import type { Palette } from "../replay/palette";
import type { Projection } from "./projection";

// Labelled positions on the axes.
const TICKS_X_M = [-0.8, -0.4, 0, 0.4, 0.8];
const TICKS_Y_M = [-0.4, -0.2, 0, 0.2, 0.4];
/** Position of the title of the y axis, above its highest label. */
const Y_AXIS_TITLE_M = 0.56;
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", sans-serif';
/** Pattern of the edge of the success region: lengths of dash and gap, pixels. */
const DASHES = [5, 4];
/** The pattern of a line without gaps. */
const SOLID: number[] = [];

/** Draws everything static. It is drawn once per size and colour scheme, then copied into each frame. */
export function drawTable(
  context: CanvasRenderingContext2D,
  projection: Projection,
  palette: Palette,
  contest: Contest,
): void {
  context.fillStyle = palette["rp-backdrop"];
  context.fillRect(0, 0, projection.width, projection.height);
  context.fillStyle = palette["rp-table"];
  // Up to the outer edge in the goals only: the outer corners of the rims are round.
  const { half_length_m, half_width_m, goal_half_width_m } = MODEL.table;
  fillMiddle(context, projection, half_length_m, half_width_m);
  fillMiddle(context, projection, OUTER_HALF_SIZE.x, goal_half_width_m + MODEL.table.post_radius_m);
  drawLines(context, projection, palette);
  drawRegion(context, projection, palette, contest);
  drawRims(context, projection, palette);
  drawAxes(context, projection, palette);
}

/** Fills a rectangle around the centre of the table. */
function fillMiddle(context: CanvasRenderingContext2D, projection: Projection, x: number, y: number): void {
  context.fillRect(projection.x(-x), projection.y(y), projection.length(2 * x), projection.length(2 * y));
}

function drawLines(context: CanvasRenderingContext2D, projection: Projection, palette: Palette): void {
  const { half_length_m, half_width_m, goal_half_width_m } = MODEL.table;
  context.strokeStyle = palette["rp-mark"];
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(projection.x(0), projection.y(half_width_m));
  context.lineTo(projection.x(0), projection.y(-half_width_m));
  const radius = projection.length(CENTRE_CIRCLE_RADIUS_M);
  context.moveTo(projection.x(0) + radius, projection.y(0));
  context.arc(projection.x(0), projection.y(0), radius, 0, 2 * Math.PI);
  context.stroke();
  // The space in front of the goals, and the goal lines in the colours of the sides.
  for (const side of [-1, 1]) {
    const x = projection.x(side * half_length_m);
    const width = projection.length(goal_half_width_m);
    context.strokeStyle = palette["rp-mark"];
    context.beginPath();
    context.arc(x, projection.y(0), width, Math.PI / 2, -Math.PI / 2, side < 0);
    context.stroke();
    context.strokeStyle = palette[side < 0 ? "rp-joint" : "rp-other-joint"];
    context.beginPath();
    context.moveTo(x, projection.y(goal_half_width_m));
    context.lineTo(x, projection.y(-goal_half_width_m));
    context.stroke();
  }
}

function drawRegion(
  context: CanvasRenderingContext2D,
  projection: Projection,
  palette: Palette,
  contest: Contest,
): void {
  const region = successRegion(contest);
  if (region === null) return;
  const x = projection.x(region.x_from_m);
  const width = projection.length(region.x_to_m - region.x_from_m);
  const y = projection.y(region.half_width_m);
  const height = projection.length(2 * region.half_width_m);
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

function drawRims(context: CanvasRenderingContext2D, projection: Projection, palette: Palette): void {
  const outline = roundedRimOutline();
  context.fillStyle = palette["rp-rim"];
  for (const mirror of [1, -1]) {
    context.beginPath();
    for (const [x, y] of outline) context.lineTo(projection.x(x), projection.y(mirror * y));
    context.closePath();
    context.fill();
  }
}

function drawAxes(context: CanvasRenderingContext2D, projection: Projection, palette: Palette): void {
  const left = projection.x(-OUTER_HALF_SIZE.x);
  const bottom = projection.y(-OUTER_HALF_SIZE.y);
  context.strokeStyle = palette.soft;
  context.fillStyle = palette.soft;
  context.lineWidth = 1;
  context.font = FONT;
  context.beginPath();
  for (const x of TICKS_X_M) {
    context.moveTo(projection.x(x), bottom);
    context.lineTo(projection.x(x), bottom + 5);
  }
  for (const y of TICKS_Y_M) {
    context.moveTo(left, projection.y(y));
    context.lineTo(left - 5, projection.y(y));
  }
  context.stroke();
  context.textAlign = "center";
  context.textBaseline = "top";
  // On a narrow picture neighbouring labels would overlap: show every second one.
  const everyX = projection.length(0.4) < 44 ? 2 : 1;
  const everyY = projection.length(0.2) < 18 ? 2 : 1;
  TICKS_X_M.forEach((x, i) => {
    if (i % everyX === 0) context.fillText(fixed(x, 1), projection.x(x), bottom + 7);
  });
  context.fillText("x, m (table frame)", projection.x(0), bottom + 22);
  context.textAlign = "right";
  context.textBaseline = "middle";
  TICKS_Y_M.forEach((y, i) => {
    if (i % everyY === 0) context.fillText(fixed(y, 1), left - 7, projection.y(y));
  });
  context.fillText("y, m", left - 7, projection.y(Y_AXIS_TITLE_M));
}
