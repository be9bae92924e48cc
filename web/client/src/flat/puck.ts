// The puck in the flat view.

import { MODEL } from "../model/model";
import type { FrameState, Look } from "../replay/frame-state";
import type { Palette } from "../replay/palette";
import type { Projection } from "./projection";

/** Pattern of the circle of the observed puck: lengths of dash and gap, pixels. */
const SEEN_DASHES = [4, 3];
/** The pattern of a line without gaps. */
const SOLID: number[] = [];
/** Size of the halo relative to the puck, its least radius in pixels, and its opacity. */
const HALO = { size: 1.9, leastRadius: 9, opacity: 0.22 };

/** Draws the puck: a disc with a halo that makes it visible in small pictures, or of a ghost its outline. */
export function drawPuck(
  context: CanvasRenderingContext2D,
  at: Projection,
  { pose }: FrameState,
  palette: Palette,
  look: Look,
): void {
  const { x, y, yaw } = pose;
  const radius = at.length(MODEL.puck.radius_m);
  if (look === "ghost") {
    context.strokeStyle = palette["rp-ghost"];
    context.lineWidth = 2;
    disc(context, at.x(x), at.y(y), radius);
    context.stroke();
  } else {
    context.fillStyle = palette["rp-puck"];
    context.globalAlpha = HALO.opacity;
    disc(context, at.x(x), at.y(y), Math.max(radius * HALO.size, HALO.leastRadius));
    context.fill();
    context.globalAlpha = 1;
    disc(context, at.x(x), at.y(y), radius);
    context.fill();
    context.strokeStyle = palette["rp-table"];
    context.lineWidth = Math.max(radius * 0.18, 1);
  }
  // The line shows the orientation.
  context.beginPath();
  context.moveTo(at.x(x), at.y(y));
  context.lineTo(at.x(x) + radius * 0.85 * Math.cos(yaw), at.y(y) - radius * 0.85 * Math.sin(yaw));
  context.stroke();
}

/** Draws where the agent sees the puck: a dashed circle, crossed out while the camera has lost it. */
export function drawSeenPuck(
  context: CanvasRenderingContext2D,
  at: Projection,
  frame: FrameState,
  palette: Palette,
): void {
  if (Number.isNaN(frame.seenX)) return;
  const x = at.x(frame.seenX);
  const y = at.y(frame.seenY);
  const radius = at.length(MODEL.puck.radius_m);
  context.strokeStyle = palette["rp-seen"];
  context.lineWidth = 2;
  context.setLineDash(SEEN_DASHES);
  disc(context, x, y, radius);
  context.stroke();
  context.setLineDash(SOLID);
  if (!frame.isPuckLost) return;
  context.beginPath();
  context.moveTo(x - radius, y - radius);
  context.lineTo(x + radius, y + radius);
  context.moveTo(x - radius, y + radius);
  context.lineTo(x + radius, y - radius);
  context.stroke();
}

function disc(context: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
}
