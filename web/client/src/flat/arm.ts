// The arm and its mallet in the flat view.

import type { Kinematics } from "../model/kinematics";
import { MODEL } from "../model/model";
import type { Projection } from "./projection";

// Line widths, m: about the thickness of the arm. They have no effect on contacts.
const LINK_WIDTH_M = 0.13;
const ROD_WIDTH_M = 0.025;

export interface ArmColours {
  readonly link: string;
  readonly mallet: string;
  readonly outline: string;
}

/** Draws the arm from above, semi-transparent because it covers puck and table. */
export function drawArm(
  context: CanvasRenderingContext2D,
  projection: Projection,
  arm: Kinematics,
  colours: ArmColours,
): void {
  context.lineCap = "round";
  context.lineJoin = "round";
  context.globalAlpha = 0.4;
  context.strokeStyle = colours.link;
  context.lineWidth = projection.length(LINK_WIDTH_M);
  context.beginPath();
  context.moveTo(projection.x(arm.base[9]), projection.y(arm.base[10]));
  for (const link of arm.links) context.lineTo(projection.x(link[9]), projection.y(link[10]));
  context.stroke();
  context.globalAlpha = 0.75;
  context.lineWidth = projection.length(ROD_WIDTH_M);
  context.beginPath();
  context.moveTo(projection.x(arm.links[6][9]), projection.y(arm.links[6][10]));
  context.lineTo(projection.x(arm.endEffector[9]), projection.y(arm.endEffector[10]));
  context.stroke();
  context.globalAlpha = 1;
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
  context.lineWidth = 1;
  context.beginPath();
  context.arc(projection.x(x), projection.y(y), radius, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  context.beginPath();
  context.arc(projection.x(x), projection.y(y), radius * 0.4, 0, 2 * Math.PI);
  context.stroke();
}
