// Interpolation of puck and arms between recorded samples.

import type { Contact, Motion } from "../clip/motion";
import { JOINT_COUNT } from "../model/model";
import { parabolaToSlope, hermite, parabolaFromSlope } from "./curves";

/** Angles of an arm at an instant, rad: the seven joints `q` and the universal joint of the mallet. */
export interface ArmPose {
  readonly q: Float64Array;
  readonly universal: Float64Array;
}

/** Puck (m and rad) and arms at an instant; one instance is reused for all frames. */
export interface Pose {
  x: number;
  y: number;
  yaw: number;
  readonly arms: readonly [ArmPose, ArmPose];
}

export function newPose(): Pose {
  const arm = (): ArmPose => ({ q: new Float64Array(JOINT_COUNT), universal: new Float64Array(2) });
  return { x: 0, y: 0, yaw: 0, arms: [arm(), arm()] };
}

/**
 * Interpolates between samples. Puck and joints follow cubics through their velocities. The puck passes through recorded
 * contacts. Everything is held at the end of a rally.
 */
export class Interpolation {
  /** By interval (sample − first): index of the first contact in `contacts`, −1 for none. */
  private readonly firstContact: Int32Array;
  /** By interval: 1 if a rally ends at its start, so that nothing moves in it. */
  private readonly isRallyEnd: Uint8Array;

  constructor(readonly motion: Motion) {
    const intervals = Math.max(motion.samples - 1, 0);
    this.firstContact = new Int32Array(intervals).fill(-1);
    this.isRallyEnd = new Uint8Array(intervals);
    motion.contacts.forEach((contact, i) => {
      const interval = this.intervalOf(contact);
      if (interval >= 0 && interval < intervals && this.firstContact[interval] < 0)
        this.firstContact[interval] = i;
    });
    for (const end of motion.rallyEnds) {
      const interval = end.sample - motion.first;
      if (interval >= 0 && interval < intervals) this.isRallyEnd[interval] = 1;
    }
  }

  /** Writes the pose at `position`, in control steps from sample 0. Outside the clip the nearest end is used. */
  poseAt(position: number, pose: Pose): void {
    const { motion } = this;
    const clipPosition = Math.min(Math.max(position - motion.first, 0), motion.samples - 1);
    const from = Math.min(Math.floor(clipPosition), Math.max(motion.samples - 2, 0));
    const isHeld = motion.samples < 2 || (this.isRallyEnd[from] === 1 && clipPosition < from + 1);
    const to = isHeld ? from : from + 1;
    const share = isHeld ? 0 : clipPosition - from;
    this.interpolatePuck(from, to, share, pose);
    for (let i = 0; i < motion.arms.length; i++) this.interpolateArm(i, from, to, share, pose.arms[i]);
  }

  private interpolatePuck(from: number, to: number, share: number, pose: Pose): void {
    const { x, y, yaw, vx, vy } = this.motion.puck;
    const h = this.motion.stepS;
    if (share === 0) {
      pose.x = x[from];
      pose.y = y[from];
    } else if (share === 1) {
      pose.x = x[to];
      pose.y = y[to];
    } else if (vx === null || vy === null) {
      pose.x = x[from] + (x[to] - x[from]) * share;
      pose.y = y[from] + (y[to] - y[from]) * share;
    } else if (this.firstContact[from] >= 0) {
      this.puckThroughContacts(from, to, share * h, vx, vy, pose);
    } else {
      pose.x = hermite(x[from], vx[from], x[to], vx[to], h, share * h);
      pose.y = hermite(y[from], vy[from], y[to], vy[to], h, share * h);
    }
    pose.yaw = yaw === null ? 0 : yaw[from] + wrapAngle(yaw[to] - yaw[from]) * share;
  }

  /**
   * Passes through the contacts of the interval. Velocities are known at samples only: the part before the first contact
   * starts with the velocity of its sample, the part after the last contact ends with that of the next, others are straight.
   */
  private puckThroughContacts(
    from: number,
    to: number,
    tau: number,
    vx: Float64Array,
    vy: Float64Array,
    pose: Pose,
  ): void {
    const { puck, contacts, stepS } = this.motion;
    const start = (from + this.motion.first) * stepS;
    let t0 = 0;
    let x0 = puck.x[from];
    let y0 = puck.y[from];
    let atSample = true;
    for (let i = this.firstContact[from]; i < contacts.length && this.intervalOf(contacts[i]) === from; i++) {
      const contact = contacts[i];
      const t1 = contact.t - start;
      if (tau < t1) {
        const h = t1 - t0;
        if (atSample) {
          pose.x = parabolaFromSlope(x0, vx[from], contact.x, h, tau);
          pose.y = parabolaFromSlope(y0, vy[from], contact.y, h, tau);
        } else {
          pose.x = x0 + ((contact.x - x0) * (tau - t0)) / h;
          pose.y = y0 + ((contact.y - y0) * (tau - t0)) / h;
        }
        return;
      }
      t0 = t1;
      x0 = contact.x;
      y0 = contact.y;
      atSample = false;
    }
    pose.x = parabolaToSlope(x0, puck.x[to], vx[to], stepS - t0, tau - t0);
    pose.y = parabolaToSlope(y0, puck.y[to], vy[to], stepS - t0, tau - t0);
  }

  private interpolateArm(index: number, from: number, to: number, share: number, pose: ArmPose): void {
    const { q, dq, universal } = this.motion.arms[index];
    const h = this.motion.stepS;
    for (let i = 0; i < JOINT_COUNT; i++) {
      pose.q[i] =
        dq === null
          ? q[i][from] + (q[i][to] - q[i][from]) * share
          : hermite(q[i][from], dq[i][from], q[i][to], dq[i][to], h, from === to ? 0 : share * h);
    }
    for (let i = 0; i < 2; i++) {
      pose.universal[i] =
        universal === null ? NaN : universal[i][from] + (universal[i][to] - universal[i][from]) * share;
    }
  }

  private intervalOf(contact: Contact): number {
    return Math.floor(contact.t / this.motion.stepS) - this.motion.first;
  }
}

/** The equivalent angle between −π and π. */
function wrapAngle(angle: number): number {
  return angle - Math.round(angle / (2 * Math.PI)) * 2 * Math.PI;
}
