// Kinematics and margins of the arm, compared with the rules and with recordings of the reference simulator.

import { readFileSync } from "node:fs";
import { gunzipSync } from "node:zlib";
import { describe, expect, it } from "vitest";
import { Kinematics, type Frame } from "../src/model/kinematics";
import { heightMargin, jointPositionMargin, linkMargin, tableMargin } from "../src/model/margins";
import { MODEL } from "../src/model/model";

/** A pose of the reference simulator: positions (robot frame) and rotations (row-major) of links 4 and 7 and of the end effector. */
type Body = "4" | "7" | "ee";
type Recorded = { q: number[] } & Record<`pos_${Body}` | `rot_${Body}`, number[]>;

const origin = (frame: Frame): number[] => [...frame.slice(9)];

function expectNear(actual: ArrayLike<number>, expected: number[], tolerance: number): void {
  expected.forEach((value, i) => {
    expect(Math.abs(actual[i] - value)).toBeLessThan(tolerance);
  });
}

describe("forward kinematics", () => {
  it("places the end effector of the initial pose as in the rules, on both sides", () => {
    const own = new Kinematics(0);
    own.set(MODEL.initial_q_rad);
    expectNear(origin(own.endEffector), [-1.51 + 0.65, 0, 0.1645 - 0.1], 1e-4);
    const opponent = new Kinematics(1);
    opponent.set(MODEL.initial_q_rad);
    expectNear(origin(opponent.endEffector), [1.51 - 0.65, 0, 0.0645], 1e-4);
  });

  it("lets the mallet hang straight down by the angles of the universal joint", () => {
    const arm = new Kinematics(0);
    arm.set(MODEL.initial_q_rad);
    const unrecorded = [...arm.malletCentre];
    // The controller's target (MODEL, "Universal joint"): the angle from x to x* about y. All turns of this pose
    // are about y, so that the second hinge stays at 0.
    const [x, y] = [0, 1].map((column) => [0, 3, 6].map((row) => arm.endEffector[row + column]));
    const level = [-y[1], y[0], 0];
    const cross = [x[1] * level[2] - x[2] * level[1], x[2] * level[0] - x[0] * level[2], x[0] * level[1] - x[1] * level[0]]; // prettier-ignore
    const dot = (a: number[], b: number[]): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    arm.set(MODEL.initial_q_rad, [Math.atan2(dot(y, cross), dot(x, level)), 0]);
    expectNear([arm.mallet[2], arm.mallet[5], arm.mallet[8]], [0, 0, -1], 1e-9);
    expectNear(arm.malletCentre, [-0.86, 0, 0.014], 1e-4);
    expectNear(arm.malletCentre, unrecorded, 1e-9);
  });

  it("turns the hinge about y before the hinge about x", () => {
    const arm = new Kinematics(0);
    arm.set(MODEL.initial_q_rad, [0, 0]);
    const ee = [...arm.endEffector];
    arm.set(MODEL.initial_q_rad, [0.3, 0.2]);
    // z of Ry(a) Rx(b) is (sin a cos b, −sin b, cos a cos b).
    const z = [Math.sin(0.3) * Math.cos(0.2), -Math.sin(0.2), Math.cos(0.3) * Math.cos(0.2)];
    expectNear([arm.mallet[2], arm.mallet[5], arm.mallet[8]], [0, 3, 6].map((r) => ee[r] * z[0] + ee[r + 1] * z[1] + ee[r + 2] * z[2]), 1e-12); // prettier-ignore
  });

  it("matches recordings of the reference simulator", () => {
    const file = new URL("../../../tests/reference/kinematics.json.gz", import.meta.url);
    const { fk } = JSON.parse(gunzipSync(readFileSync(file)).toString()) as { fk: Recorded[] };
    expect(fk.length).toBeGreaterThanOrEqual(200);
    const arm = new Kinematics(0);
    for (const recorded of fk) {
      arm.set(recorded.q);
      const frames: [Body, Frame][] = [["4", arm.links[3]], ["7", arm.links[6]], ["ee", arm.endEffector]]; // prettier-ignore
      for (const [body, frame] of frames) {
        const [x, y, z] = origin(frame);
        expectNear([x + 1.51, y, z + 0.1], recorded[`pos_${body}`], 1e-6);
        expectNear(frame, recorded[`rot_${body}`], 1e-6);
      }
    }
  });

  it("finds no violation in the initial pose", () => {
    const arm = new Kinematics(0);
    arm.set(MODEL.initial_q_rad);
    expect(jointPositionMargin(MODEL.initial_q_rad)).toBeCloseTo(0.95 * 2.0944 - 1.84363898, 9);
    expect(heightMargin(arm)).toBeCloseTo(0.02, 4);
    expect(tableMargin(arm)).toBeCloseTo(0.974 - 0.86 - 0.04815, 4);
    expect(linkMargin(arm)).toBeGreaterThan(0);
    const opponent = new Kinematics(1);
    opponent.set(MODEL.initial_q_rad);
    expect(tableMargin(opponent)).toBeCloseTo(tableMargin(arm), 9);
  });
});
