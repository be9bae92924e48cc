// Paths of puck and mallets as lines through space.

import type { Motion } from "../clip/motion";
import type { Observed } from "../clip/observed";
import { Kinematics } from "../model/kinematics";
import { JOINT_COUNT } from "../model/model";
import { Interpolation, newPose } from "./pose";

/** A line through space. Each of its points belongs to a position of the replay, in control steps. */
export interface Path {
  readonly positions: Float64Array;
  /** x, y, z one after the other, table frame. */
  readonly points: Float32Array;
  /** 1 at a point: no line from this point to the next one, because a rally ended or data is missing. */
  readonly gaps: Uint8Array;
}

/** Lines of one part of a replay. */
export interface Paths {
  readonly puck: Path;
  /** Actual path of the end effector, per arm. */
  readonly mallets: readonly Path[];
  /** Commanded path of the end effector; null if the viewer may not see it. */
  readonly commanded: Path | null;
}

/** Points of the path of the puck per control step, in addition to contacts. */
const PUCK_POINTS_PER_STEP = 4;
/** Points of the path of a mallet per control step. */
const MALLET_POINTS_PER_STEP = 4;
/** Height of the path of the puck above the table, so that it stays visible. */
const PUCK_LINE_Z_M = 0.002;

export function pathsOf(motion: Motion, interpolation: Interpolation, observed: Observed | null): Paths {
  const command = observed?.command ?? null;
  return {
    puck: puckPath(motion, interpolation),
    mallets: motion.arms.map((_, side) => malletPath(motion, interpolation, side === 0 ? 0 : 1)),
    commanded: observed === null || command === null ? null : commandedPath(observed, command),
  };
}

/** Indices of the points between two positions, as [first, last]; last < first if there are none. */
export function pointsBetween(path: Path, from: number, to: number): [number, number] {
  return [firstIndexFrom(path.positions, from), firstIndexFrom(path.positions, to + 1e-9) - 1];
}

/** Index of the first value that is at least `value`. */
function firstIndexFrom(sorted: Float64Array, value: number): number {
  let low = 0;
  let high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

function puckPath(motion: Motion, interpolation: Interpolation): Path {
  const last = motion.first + motion.samples - 1;
  const positions: number[] = motion.contacts
    .map((contact) => contact.t / motion.stepS)
    .filter((position) => position > motion.first && position < last);
  for (let k = 0; k < motion.samples; k++) {
    for (let i = 0; i < (k < motion.samples - 1 ? PUCK_POINTS_PER_STEP : 1); i++)
      positions.push(motion.first + k + i / PUCK_POINTS_PER_STEP);
  }
  positions.sort((a, b) => a - b);
  const ends = new Set(motion.rallyEnds.map((end) => end.sample));
  const points = new Float32Array(3 * positions.length);
  const gaps = new Uint8Array(positions.length);
  const pose = newPose();
  positions.forEach((position, i) => {
    interpolation.poseAt(position, pose);
    points.set([pose.x, pose.y, PUCK_LINE_Z_M], 3 * i);
    if (ends.has(Math.floor(position))) gaps[i] = 1;
  });
  return { positions: Float64Array.from(positions), points, gaps };
}

/** Points at quarter steps, so that the line ends at the mallet also between samples. */
function malletPath(motion: Motion, interpolation: Interpolation, side: 0 | 1): Path {
  const count = (motion.samples - 1) * MALLET_POINTS_PER_STEP + 1;
  const positions = new Float64Array(count);
  const points = new Float32Array(3 * count);
  const gaps = new Uint8Array(count);
  const ends = new Set(motion.rallyEnds.map((end) => end.sample));
  const arm = new Kinematics(side);
  const pose = newPose();
  for (let i = 0; i < count; i++) {
    positions[i] = motion.first + i / MALLET_POINTS_PER_STEP;
    interpolation.poseAt(positions[i], pose);
    arm.set(pose.arms[side].q);
    points.set(arm.endEffector.subarray(9, 12), 3 * i);
    if (ends.has(Math.floor(positions[i]))) gaps[i] = 1;
  }
  return { positions, points, gaps };
}

function commandedPath(observed: Observed, command: readonly Float64Array[]): Path {
  const { first, samples, side } = observed;
  const positions = new Float64Array(samples);
  const points = new Float32Array(3 * samples);
  const gaps = new Uint8Array(samples);
  const arm = new Kinematics(side);
  const q = new Float64Array(JOINT_COUNT);
  for (let k = 0; k < samples; k++) {
    positions[k] = first + k;
    for (let i = 0; i < JOINT_COUNT; i++) q[i] = command[i][k];
    if (Number.isNaN(q[0])) {
      // No command for this sample: no line to it or from it.
      gaps[k] = 1;
      if (k > 0) gaps[k - 1] = 1;
      continue;
    }
    arm.set(q);
    points.set(arm.endEffector.subarray(9, 12), 3 * k);
  }
  return { positions, points, gaps };
}
