// Numbers of robot and table.

import numbers from "./model.json";

/** Robot and table. All numbers are in `model.json`; a test of the simulator compares them with its own. */
export const MODEL = numbers;

export const JOINT_COUNT = 7;

const RAD_PER_DEG = Math.PI / 180;

/** Joint velocity limits ±, rad/s. */
export const VELOCITY_LIMITS: readonly number[] = numbers.links.map(
  (link) => link.velocity_limit_deg_s * RAD_PER_DEG,
);

/** Joint ranges ±, rad. */
export const JOINT_RANGES: readonly number[] = numbers.links.map((link) => link.range_rad);
