import type { Kinematics } from "../model/kinematics";
import { MODEL } from "../model/model";
import type { Projection } from "./projection";

// Line widths, m: about the thickness of the arm. They have no effect on contacts.
const LINK_WIDTH = 0.13;
const ROD_WIDTH = 0.025;

export interface ArmColours {
  readonly link: string;
  readonly mallet: string;
  readonly outline: string;
}

/** Draws the arm from above, semi-transparent because it covers puck and table. */
export function drawArm(
  context: CanvasRenderingContext2D,
  at: Projection,
  arm: Kinematics,
  colours: ArmColours,
): void {
  context.lineCap = "round";
  context.lineJoin = "round";
  context.globalAlpha = 0.4;
  context.strokeStyle = colours.link;
  context.lineWidth = at.length(LINK_WIDTH);
  context.beginPath();
  context.moveTo(at.x(arm.base[9]), at.y(arm.base[10]));
  for (const link of arm.links) context.lineTo(at.x(link[9]), at.y(link[10]));
  context.stroke();
  context.globalAlpha = 0.75;
  context.lineWidth = at.length(ROD_WIDTH);
  context.beginPath();
  context.moveTo(at.x(arm.links[6][9]), at.y(arm.links[6][10]));
  context.lineTo(at.x(arm.endEffector[9]), at.y(arm.endEffector[10]));
  context.stroke();
  context.globalAlpha = 1;
}

export function drawMallet(
  context: CanvasRenderingContext2D,
  at: Projection,
  arm: Kinematics,
  colours: ArmColours,
): void {
  const [x, y] = arm.malletCentre;
  const radius = at.length(MODEL.mallet.radius_m);
  context.fillStyle = colours.mallet;
  context.strokeStyle = colours.outline;
  context.lineWidth = 1;
  context.beginPath();
  context.arc(at.x(x), at.y(y), radius, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  context.beginPath();
  context.arc(at.x(x), at.y(y), radius * 0.4, 0, 2 * Math.PI);
  context.stroke();
}
