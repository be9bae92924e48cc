// Interpolation of the puck between samples.

import { describe, expect, it } from "vitest";
import { decodeMotion, type Motion } from "../src/clip/motion";
import { Interpolation, newPose } from "../src/motion/pose";
import { encode, stillArmColumns, type TestColumn } from "./encoder";

/** Duration of a control step. */
const STEP_S = 0.02;

/** A recording of a puck whose position and velocity are functions of the time in seconds. */
function motionOfPuck(
  samples: number,
  position: (t: number) => [number, number],
  velocity: (t: number) => [number, number],
  header: Record<string, unknown> = {},
): Motion {
  const column = (name: string, value: (t: number) => number): TestColumn => ({
    name,
    scale: 1e-6,
    values: Array.from({ length: samples }, (_, k) => value(k * STEP_S)),
  });
  return decodeMotion(
    encode({ samples, ...header }, [
      // The arm's columns alone: the first two are the puck's, which follow below.
      ...stillArmColumns(samples, () => 0, () => 0).slice(2), // prettier-ignore
      column("puck_x", (t) => position(t)[0]),
      column("puck_y", (t) => position(t)[1]),
      column("puck_vx", (t) => velocity(t)[0]),
      column("puck_vy", (t) => velocity(t)[1]),
    ]),
  );
}

describe("interpolation", () => {
  it("follows a cubic exactly between samples", () => {
    const motion = motionOfPuck(
      6,
      (t) => [t * t * t, 1 - t * t],
      (t) => [3 * t * t, -2 * t],
    );
    const interpolation = new Interpolation(motion);
    const pose = newPose();
    for (let position = 0; position <= 5; position += 0.13) {
      const t = position * STEP_S;
      interpolation.poseAt(position, pose);
      expect(pose.x).toBeCloseTo(t ** 3, 5);
      expect(pose.y).toBeCloseTo(1 - t * t, 5);
    }
  });

  it("bounces exactly at the recorded contact", () => {
    // Straight to y = 0.4 at 0.034 s, then straight back at three quarters of the speed.
    const hit = 0.034;
    const y = (t: number): number => (t < hit ? 0.4 + 2 * (t - hit) : 0.4 - 1.5 * (t - hit));
    const motion = motionOfPuck(
      4,
      (t) => [t, y(t)],
      (t) => [1, t < hit ? 2 : -1.5],
      { contacts: [{ t: hit, what: "rim", x: hit, y: 0.4 }] },
    );
    const interpolation = new Interpolation(motion);
    const pose = newPose();
    for (let position = 0; position <= 3; position += 0.05) {
      interpolation.poseAt(position, pose);
      expect(pose.y).toBeCloseTo(y(position * STEP_S), 5);
      expect(pose.x).toBeCloseTo(position * STEP_S, 5);
    }
  });

  it("passes through all contacts of an interval", () => {
    const contacts = [
      { t: 0.005, what: "rim", x: 0.1, y: 0.4 },
      { t: 0.012, what: "mallet", x: 0.2, y: 0.3 },
    ];
    const motion = motionOfPuck(2, () => [0, 0], () => [0, 0], { contacts }); // prettier-ignore
    const interpolation = new Interpolation(motion);
    const pose = newPose();
    for (const contact of contacts) {
      interpolation.poseAt(contact.t / STEP_S, pose);
      expect(pose.x).toBeCloseTo(contact.x, 9);
      expect(pose.y).toBeCloseTo(contact.y, 9);
    }
    interpolation.poseAt(1, pose);
    expect(pose.x).toBeCloseTo(0, 9);
  });

  it("holds between the end of a rally and the next one", () => {
    const motion = motionOfPuck(4, (t) => [t < 0.03 ? 0.9 : -0.5, 0], () => [0, 0], {
      contest: "game",
      breaks: [{ sample: 1, what: "goal", by: 0, score: [1, 0] }],
    }); // prettier-ignore
    const pose = newPose();
    const interpolation = new Interpolation(motion);
    interpolation.poseAt(1.99, pose);
    expect(pose.x).toBeCloseTo(0.9, 9);
    interpolation.poseAt(2, pose);
    expect(pose.x).toBeCloseTo(-0.5, 9);
  });

  it("counts positions from the start of the game and holds outside the chunk", () => {
    const motion = motionOfPuck(3, (t) => [t, 0], () => [1, 0], { first: 500 }); // prettier-ignore
    const pose = newPose();
    const interpolation = new Interpolation(motion);
    interpolation.poseAt(501.5, pose);
    expect(pose.x).toBeCloseTo(0.03, 6);
    interpolation.poseAt(9999, pose);
    expect(pose.x).toBeCloseTo(0.04, 6);
  });

  it("keeps unrecorded universal joint angles as NaN", () => {
    const pose = newPose();
    new Interpolation(motionOfPuck(2, () => [0, 0], () => [0, 0])).poseAt(0.5, pose); // prettier-ignore
    expect(pose.arms[0].universal[0]).toBeNaN();
    // In a recording of a still arm, the joint with index i is at 0.1 i rad.
    expect(pose.arms[0].q[3]).toBeCloseTo(0.3, 6);
  });
});
