// The values that strip charts show: distances from limits, joint speeds and computation times.

import type { ConstraintGroup, Violation } from "../clip/motion";
import { fixed } from "../controls/format";
import { Kinematics } from "../model/kinematics";
import {
  heightMargin,
  jointPositionMargin,
  jointVelocityMargin,
  linkMargin,
  tableMargin,
  velocityShare,
} from "../model/margins";
import { JOINT_COUNT, MODEL } from "../model/model";
import type { ColourName } from "../replay/palette";
import type { ReplayPart } from "../replay/source";

/** A line of a chart: a value per sample. */
export interface Line {
  readonly values: Float64Array;
  readonly colour: ColourName;
}

/** A chart: lines over the samples of a part, with a limit. */
export interface Series {
  readonly title: string;
  readonly unit: string;
  readonly lines: readonly Line[];
  readonly limit: number;
  /** The side of the limit on which values are allowed. */
  readonly allowed: "above" | "below";
  /** Recorded violations as ranges of samples, inclusive. */
  readonly violations: readonly { readonly from: number; readonly to: number }[];
  /** Text of the value at a sample, with its unit. */
  readonly valueText: (k: number) => string;
  readonly digits: number;
}

/** Charts of one arm; charts without data are omitted. */
export function seriesOf(part: ReplayPart, side: 0 | 1): Series[] {
  const { motion, observed } = part;
  const arm = motion.arms[side];
  const margins = marginsOf(part, side);
  const violations = (group: ConstraintGroup): Violation[] =>
    motion.violations.filter((violation) => violation.side === side && violation.group === group);

  const margin = (
    title: string,
    values: Float64Array,
    unit: string,
    digits: number,
    group: ConstraintGroup,
  ): Series => ({
    title,
    unit,
    lines: [{ values, colour: "accent" }],
    limit: 0,
    allowed: "above",
    violations: violations(group),
    digits,
    valueText: (k) => `${fixed(values[k], digits)} ${unit}${values[k] <= 0 ? " ▲ beyond" : ""}`,
  });

  const all = [
    margin("End effector height: margin", margins.height, "mm", 1, "ee"),
    margin("Edge of the table: margin", margins.table, "mm", 0, "ee"),
    margin("Elbow and wrist height: margin", margins.link, "mm", 0, "link"),
    margin("Joint positions: smallest margin", margins.position, "rad", 3, "joint_pos"),
  ];
  if (arm.dq !== null) {
    all.push(margin("Joint velocities: smallest margin", margins.velocity, "rad/s", 2, "joint_vel"));
    all.push(jointSpeedShares(arm.dq, violations("joint_vel")));
  }
  if (observed !== null && observed.side === side && observed.computationTimeS !== null) {
    all.push(computationTime(observed.computationTimeS, observed.hostTimeS, observed.late));
  }
  return all;
}

function marginsOf(
  part: ReplayPart,
  side: 0 | 1,
): Record<"position" | "velocity" | "height" | "table" | "link", Float64Array> {
  const { motion } = part;
  const { q, dq } = motion.arms[side];
  const emptyRow = (): Float64Array => new Float64Array(motion.samples).fill(NaN);
  const margins = {
    position: emptyRow(),
    velocity: emptyRow(),
    height: emptyRow(),
    table: emptyRow(),
    link: emptyRow(),
  };
  const arm = new Kinematics(side);
  const angles = new Float64Array(JOINT_COUNT);
  const velocities = new Float64Array(JOINT_COUNT);
  for (let k = 0; k < motion.samples; k++) {
    for (let i = 0; i < JOINT_COUNT; i++) {
      angles[i] = q[i][k];
      velocities[i] = dq === null ? NaN : dq[i][k];
    }
    arm.set(angles);
    margins.position[k] = jointPositionMargin(angles);
    margins.velocity[k] = jointVelocityMargin(velocities);
    margins.height[k] = 1000 * heightMargin(arm);
    margins.table[k] = 1000 * tableMargin(arm);
    margins.link[k] = 1000 * linkMargin(arm);
  }
  return margins;
}

function jointSpeedShares(dq: readonly Float64Array[], violations: readonly Violation[]): Series {
  const lines = dq.map((values, joint) => ({
    values: values.map((velocity) => 100 * velocityShare(joint, velocity)),
    colour: `rp-${joint + 1}` as ColourName,
  }));
  return {
    title: "Joint speeds, share of limit",
    unit: "%",
    lines,
    limit: 100 * MODEL.constraints.limit_fraction,
    allowed: "below",
    violations,
    digits: 0,
    valueText: (k) => {
      const fastest = lines.reduce(
        (best, line, joint) => (line.values[k] > lines[best].values[k] ? joint : best),
        0,
      );
      return `joint ${fastest + 1}: ${fixed(lines[fastest].values[k], 0)} %`;
    },
  };
}

function computationTime(times: Float64Array, host: Float64Array | null, late: readonly number[]): Series {
  const values = times.map((time) => 1000 * time);
  return {
    title: "Computation time",
    unit: "ms",
    lines: [{ values, colour: "accent" }],
    limit: 1000 * MODEL.constraints.computation_time_s,
    allowed: "below",
    violations: late.map((sample) => ({ from: sample, to: sample })),
    digits: 1,
    valueText: (k) => {
      if (Number.isNaN(values[k])) return "–";
      const hostText = host === null || !(host[k] > 0) ? "" : `, host ${fixed(1000 * host[k], 1)} ms`;
      return `${fixed(values[k], 1)} ms${hostText}`;
    },
  };
}
