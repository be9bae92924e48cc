import type { Group, Violation } from "../clip/motion";
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
import { JOINTS, MODEL } from "../model/model";
import type { ColourName } from "../replay/palette";
import type { Part } from "../replay/source";

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
  /** The allowed side of the limit. */
  readonly allowed: "above" | "below";
  /** Recorded violations as ranges of samples, inclusive. */
  readonly violations: readonly { readonly from: number; readonly to: number }[];
  /** Text of the value at a sample, with its unit. */
  readonly valueText: (k: number) => string;
  readonly digits: number;
}

/** Charts of one arm; charts without data are omitted. */
export function seriesOf(part: Part, side: 0 | 1): Series[] {
  const { motion, observed } = part;
  const arm = motion.arms[side];
  const margins = marginsOf(part, side);
  const violations = (group: Group): Violation[] =>
    motion.violations.filter((violation) => violation.side === side && violation.group === group);

  const margin = (
    title: string,
    values: Float64Array,
    unit: string,
    digits: number,
    group: Group,
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
    all.push(shares(arm.dq, violations("joint_vel")));
  }
  if (observed !== null && observed.side === side && observed.computationTimeS !== null) {
    all.push(computation(observed.computationTimeS, observed.hostTimeS, observed.late));
  }
  return all;
}

function marginsOf(
  part: Part,
  side: 0 | 1,
): Record<"position" | "velocity" | "height" | "table" | "link", Float64Array> {
  const { motion } = part;
  const { q, dq } = motion.arms[side];
  const row = (): Float64Array => new Float64Array(motion.samples).fill(NaN);
  const found = { position: row(), velocity: row(), height: row(), table: row(), link: row() };
  const arm = new Kinematics(side);
  const at = new Float64Array(JOINTS);
  const speed = new Float64Array(JOINTS);
  for (let k = 0; k < motion.samples; k++) {
    for (let i = 0; i < JOINTS; i++) {
      at[i] = q[i][k];
      speed[i] = dq === null ? NaN : dq[i][k];
    }
    arm.set(at);
    found.position[k] = jointPositionMargin(at);
    found.velocity[k] = jointVelocityMargin(speed);
    found.height[k] = 1000 * heightMargin(arm);
    found.table[k] = 1000 * tableMargin(arm);
    found.link[k] = 1000 * linkMargin(arm);
  }
  return found;
}

function shares(dq: readonly Float64Array[], violations: readonly Violation[]): Series {
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

function computation(times: Float64Array, host: Float64Array | null, late: readonly number[]): Series {
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
      const hosts = host === null || !(host[k] > 0) ? "" : `, host ${fixed(1000 * host[k], 1)} ms`;
      return `${fixed(values[k], 1)} ms${hosts}`;
    },
  };
}
