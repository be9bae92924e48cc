// Distances of an arm from the limits that the rules set.

import type { Angles, Kinematics } from "./kinematics";
import { JOINT_COUNT, MODEL, JOINT_RANGES, VELOCITY_LIMITS } from "./model";

const CONSTRAINTS = MODEL.constraints;

/** Smallest distance of a joint from 95 % of its range, rad; negative beyond it. */
export function jointPositionMargin(q: Angles): number {
  let least = Infinity;
  for (let i = 0; i < JOINT_COUNT; i++)
    least = Math.min(least, CONSTRAINTS.limit_fraction * JOINT_RANGES[i] - Math.abs(q[i]));
  return least;
}

/** Smallest distance of a joint velocity from 95 % of its limit, rad/s. */
export function jointVelocityMargin(dq: Angles): number {
  let least = Infinity;
  for (let i = 0; i < JOINT_COUNT; i++) {
    least = Math.min(least, CONSTRAINTS.limit_fraction * VELOCITY_LIMITS[i] - Math.abs(dq[i]));
  }
  return least;
}

/** A joint's speed as a share of its limit. */
export function velocityShare(joint: number, velocity: number): number {
  return Math.abs(velocity) / VELOCITY_LIMITS[joint];
}

/** Distance of the end effector's height from the edge of its tolerance, m. */
export function heightMargin(arm: Kinematics): number {
  // Elements 9, 10 and 11 of a frame are x, y and z of its origin (kinematics.ts).
  const height = arm.heightAboveBase(arm.endEffector[11]);
  return CONSTRAINTS.ee_height_tolerance_m - Math.abs(height - CONSTRAINTS.ee_height_m);
}

/** Distance of the end effector from the nearest edge of its half of the table, m: the own short side and both long sides. */
export function tableMargin(arm: Kinematics): number {
  const { half_length_m, half_width_m } = MODEL.table;
  const radius = MODEL.mallet.radius_m;
  const forward = arm.side === 0 ? arm.endEffector[9] : -arm.endEffector[9];
  return Math.min(forward + (half_length_m - radius), half_width_m - radius - Math.abs(arm.endEffector[10]));
}

/** Height of the lower one of elbow (link 4) and wrist (link 7) above the limit, m. */
export function linkMargin(arm: Kinematics): number {
  return arm.heightAboveBase(Math.min(arm.links[3][11], arm.links[6][11])) - CONSTRAINTS.link_height_m;
}
