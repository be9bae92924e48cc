// Forward kinematics of the arm: frames of its links from the angles of its joints.

import { JOINT_COUNT, MODEL } from "./model";

/** A frame: rotation (row-major) and origin, in one array of twelve: r00 r01 r02 r10 … r22 x y z. */
export type Frame = Float64Array;

/** Angles of hinges, rad. */
export type Angles = ArrayLike<number>;

const LINK_FRAMES: readonly Frame[] = MODEL.links.map((link) =>
  linkFrame(link.orientation_wxyz, link.position_m),
);

/** Orientation of a mallet that hangs straight down, the target of the universal joint's controller. */
const DOWNWARDS_ROTATION = [1, 0, 0, 0, -1, 0, 0, 0, -1];

/** Angles of a universal joint that was not recorded: the mallet is assumed to hang straight down. */
export const UNRECORDED_ANGLES: Angles = [NaN, NaN];

/**
 * Forward kinematics of one arm in the table frame. `set` overwrites the frames of the instance: a replay updates them 60
 * times a second and must not allocate.
 */
export class Kinematics {
  /** Link frames 1 to 7, after the rotation of their joints. */
  readonly links: readonly Frame[] = Array.from({ length: JOINT_COUNT }, () => new Float64Array(12));
  /** The end effector ("striker joint link"), fixed on link 7. */
  readonly endEffector: Frame = new Float64Array(12);
  /** The mallet on the universal joint; the axis of its cylinder is z. */
  readonly mallet: Frame = new Float64Array(12);
  /** Centre of the mallet's cylinder. */
  readonly malletCentre = new Float64Array(3);
  /** The base of the robot in the table frame. */
  readonly base: Frame;

  /** `side` 0: robot 1 at negative x; 1: robot 2, opposite, turned by half a turn. */
  constructor(readonly side: 0 | 1) {
    const base = MODEL.bases[side];
    const cos = Math.round(Math.cos(base.turn_rad));
    this.base = new Float64Array([cos, 0, 0, 0, cos, 0, 0, 0, 1, base.x_m, base.y_m, base.z_m]);
  }

  /** Updates all frames from the angles of the seven joints and of the universal joint. */
  set(q: Angles, universal: Angles = UNRECORDED_ANGLES): void {
    let parent = this.base;
    for (let i = 0; i < JOINT_COUNT; i++) {
      compose(parent, LINK_FRAMES[i], this.links[i]);
      rotateZ(this.links[i], q[i]);
      parent = this.links[i];
    }
    const ee = this.endEffector;
    ee.set(parent);
    pointOnZAxis(parent, MODEL.end_effector_z_m, ee, 9);
    this.mallet.set(ee);
    if (Number.isNaN(universal[0])) {
      this.mallet.set(DOWNWARDS_ROTATION);
    } else {
      // Hinge y, then hinge x.
      rotateY(this.mallet, universal[0]);
      rotateX(this.mallet, universal[1]);
    }
    pointOnZAxis(this.mallet, MODEL.mallet.centre_z_m, this.malletCentre, 0);
  }

  /** Converts a height from the table frame to the base frame of the robot, which the constraints use. */
  heightAboveBase(z: number): number {
    return z - this.base[11];
  }
}

/** Writes the point at distance `z` along a frame's z axis to `out`, from index `offset`. */
function pointOnZAxis(frame: Frame, z: number, out: Float64Array, offset: number): void {
  out[offset] = frame[9] + frame[2] * z;
  out[offset + 1] = frame[10] + frame[5] * z;
  out[offset + 2] = frame[11] + frame[8] * z;
}

/** Writes the frame `b`, which is given relative to `a`, to `out`. */
function compose(a: Frame, b: Frame, out: Frame): void {
  for (let row = 0; row < 3; row++) {
    const r = row * 3;
    for (let column = 0; column < 3; column++) {
      out[r + column] = a[r] * b[column] + a[r + 1] * b[3 + column] + a[r + 2] * b[6 + column];
    }
    out[9 + row] = a[9 + row] + a[r] * b[9] + a[r + 1] * b[10] + a[r + 2] * b[11];
  }
}

function rotateZ(frame: Frame, angle: number): void {
  rotateColumns(frame, 0, 1, angle);
}

function rotateY(frame: Frame, angle: number): void {
  rotateColumns(frame, 2, 0, angle);
}

function rotateX(frame: Frame, angle: number): void {
  rotateColumns(frame, 1, 2, angle);
}

/** Rotates the frame about one of its axes: column `u` towards column `v` of its rotation. */
function rotateColumns(frame: Frame, u: number, v: number, angle: number): void {
  const cos = Math.cos(angle);
  const sin = Math.sin(angle);
  for (let row = 0; row < 9; row += 3) {
    const a = frame[row + u];
    const b = frame[row + v];
    frame[row + u] = a * cos + b * sin;
    frame[row + v] = b * cos - a * sin;
  }
}

/** The frame of a link relative to its parent, from a unit quaternion w, x, y, z and a position. */
function linkFrame(orientation: readonly number[], position: readonly number[]): Frame {
  const [w, x, y, z] = orientation;
  const [px, py, pz] = position;
  return new Float64Array([
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    px, py, pz,
  ]); // prettier-ignore
}
