import numbers from "./model.json";

/** The robot and the table; every number stands in `model.json`, which a test of the simulator holds to its own. */
export const MODEL = numbers;

export const JOINTS = 7;

const RAD_PER_DEG = Math.PI / 180;

/** Joint velocity limits ±, rad/s. */
export const VELOCITY_LIMITS: readonly number[] = numbers.links.map(
  (link) => link.velocity_limit_deg_s * RAD_PER_DEG,
);

/** Joint ranges ±, rad. */
export const RANGES: readonly number[] = numbers.links.map((link) => link.range_rad);
