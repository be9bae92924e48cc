// What each camera shows.

import { MODEL } from "../model/model";
import { OUTER_HALF_SIZE } from "../model/table";
import type { Camera, CameraPosition } from "../replay/fragment";
import { corners, fit, type Field, type Point3 } from "./framing";
import { FLOOR_Z_M } from "./room";

const RAD_PER_DEG = Math.PI / 180;
/** Share of the picture that stays free on each side. */
const MARGIN = 0.035;
/** Around the base: what an arm needs at most when it plays, m. */
const ARM = { halfWidth: 0.13, behind: 0.2, height: 0.87 };
/** Half the size of what is shown around the puck, m. */
const NEAR_PUCK = { x: 0.62, y: 0.42, height: 0.3 };
/** The camera follows the puck by these shares, so that the table moves less. */
const FOLLOW = { x: 0.85, y: 0.6 };

const DIRECTIONS: Record<Camera, { readonly azimuth: number; readonly elevation: number }> = {
  corner: { azimuth: -116 * RAD_PER_DEG, elevation: 27 * RAD_PER_DEG },
  side: { azimuth: -90 * RAD_PER_DEG, elevation: 13 * RAD_PER_DEG },
  robot: { azimuth: 180 * RAD_PER_DEG, elevation: 50 * RAD_PER_DEG },
  above: { azimuth: -90 * RAD_PER_DEG, elevation: 89.5 * RAD_PER_DEG },
  follow: { azimuth: -116 * RAD_PER_DEG, elevation: 34 * RAD_PER_DEG },
};

/** The position of a camera for a number of arms and a shape of the picture. */
export function cameraPosition(camera: Camera, arms: number, field: Field): CameraPosition {
  const { azimuth, elevation } = DIRECTIONS[camera];
  return fit(pointsOf(camera, arms), azimuth, elevation, field, MARGIN);
}

/** The points that a camera shows. */
export function pointsOf(camera: Camera, arms: number): Point3[] {
  if (camera === "follow") {
    const { x, y, height } = NEAR_PUCK;
    return corners([-x, x], [-y, y], [0, height]);
  }
  const { x, y } = OUTER_HALF_SIZE;
  const tray = x + 0.08;
  const table = corners([-tray, tray], [-y, y], [0, 0.03]);
  const bases = MODEL.bases.slice(0, arms);
  if (camera === "robot") return table;
  // What is high above the table would push the camera away from it.
  if (camera === "above") return [...table, ...bases.map((base) => ({ x: base.x_m, y: base.y_m, z: 0 }))];
  const feet = corners([-0.9, 0.9], [-0.48, 0.48], [FLOOR_Z_M]);
  return [...table, ...feet, ...bases.flatMap(armPoints)];
}

function armPoints(base: (typeof MODEL.bases)[number]): Point3[] {
  const outwards = Math.sign(base.x_m);
  const [from, to] = [base.x_m - outwards * ARM.halfWidth, base.x_m + outwards * ARM.behind];
  return [
    ...corners([from, to], [-ARM.halfWidth, ARM.halfWidth], [base.z_m, base.z_m + ARM.height]),
    ...corners([base.x_m], [-ARM.halfWidth, ARM.halfWidth], [FLOOR_Z_M]),
  ];
}

/** The point that the camera looks at while it follows the puck. */
export function followedPoint(x: number, y: number): { x: number; y: number } {
  const { half_length_m, half_width_m } = MODEL.table;
  const limit = (value: number, half: number): number => Math.min(Math.max(value, -half), half);
  return { x: FOLLOW.x * limit(x, half_length_m), y: FOLLOW.y * limit(y, half_width_m) };
}
