// The arm and its mallet in the flat view.

import type { Kinematics } from "../model/kinematics";
import { MODEL } from "../model/model";
import type { Projection } from "./projection";

// Line widths, m: about the thickness of the arm. They have no effect on contacts.
const LINK_WIDTH_M = 0.13;
const ROD_WIDTH_M = 0.025;
/** Width of an outline, pixels. */
const OUTLINE_WIDTH = 2;

export interface ArmColours {
  readonly link: string;
  readonly mallet: string;
  /** Colour and width (pixels) of the line around the mallet. */
  readonly outline: string;
  readonly outlineWidth: number;
  readonly malletOpacity: number;
}

/** Draws the arm from above, semi-transparent because it covers puck and table. */
export function drawArm(
  context: CanvasRenderingContext2D,
  projection: Projection,
  arm: Kinematics,
  colours: ArmColours,
): void {
  context.globalAlpha = 0.4;
  context.strokeStyle = colours.link;
  strokeLinks(context, projection, arm, projection.length(LINK_WIDTH_M));
  context.globalAlpha = 0.75;
  strokeRod(context, projection, arm);
  context.globalAlpha = 1;
}

/** Draws the outline of the arm from above. The canvas must be empty: what is inside of the outline is erased. */
export function drawArmOutline(
  context: CanvasRenderingContext2D,
  projection: Projection,
  arm: Kinematics,
  colours: ArmColours,
): void {
  const width = projection.length(LINK_WIDTH_M);
  context.strokeStyle = colours.link;
  strokeLinks(context, projection, arm, width);
  context.globalCompositeOperation = "destination-out";
  strokeLinks(context, projection, arm, Math.max(width - 2 * OUTLINE_WIDTH, 0.1));
  context.globalCompositeOperation = "source-over";
  strokeRod(context, projection, arm);
}

function strokeLinks(
  context: CanvasRenderingContext2D,
  projection: Projection,
  arm: Kinematics,
  width: number,
): void {
  context.lineCap = "round";
  context.lineJoin = "round";
  context.lineWidth = width;
  context.beginPath();
  // The numbers 9, 10 and 11 of a frame are its origin: x, y, z.
  context.moveTo(projection.x(arm.base[9]), projection.y(arm.base[10]));
  for (const link of arm.links) context.lineTo(projection.x(link[9]), projection.y(link[10]));
  context.stroke();
}

function strokeRod(context: CanvasRenderingContext2D, projection: Projection, arm: Kinematics): void {
  context.lineWidth = projection.length(ROD_WIDTH_M);
  context.beginPath();
  context.moveTo(projection.x(arm.links[6][9]), projection.y(arm.links[6][10]));
  context.lineTo(projection.x(arm.endEffector[9]), projection.y(arm.endEffector[10]));
  context.stroke();
}

export function drawMallet(
  context: CanvasRenderingContext2D,
  projection: Projection,
  arm: Kinematics,
  colours: ArmColours,
): void {
  const [x, y] = arm.malletCentre;
  const radius = projection.length(MODEL.mallet.radius_m);
  context.fillStyle = colours.mallet;
  context.strokeStyle = colours.outline;
  context.lineWidth = colours.outlineWidth;
  context.beginPath();
  context.arc(projection.x(x), projection.y(y), radius, 0, 2 * Math.PI);
  context.globalAlpha = colours.malletOpacity;
  context.fill();
  context.globalAlpha = 1;
  context.stroke();
  context.beginPath();
  context.arc(projection.x(x), projection.y(y), radius * 0.4, 0, 2 * Math.PI);
  context.stroke();
}
