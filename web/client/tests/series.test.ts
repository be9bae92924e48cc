// Strip charts, paths and the outline of the rims.

import { describe, expect, it } from "vitest";
import { decodeMotion } from "../src/clip/motion";
import { MODEL, VELOCITY_LIMITS } from "../src/model/model";
import { rimOutline } from "../src/model/table";
import { pointsBetween, pathsOf } from "../src/motion/paths";
import { Interpolation } from "../src/motion/pose";
import type { ReplayPart } from "../src/replay/source";
import { rangeOf } from "../src/strips/plot";
import { seriesOf } from "../src/strips/series";
import { encode, type TestColumn } from "./encoder";

/** The arm in its initial pose, its fourth joint at the given share of its speed limit; a puck that slides. */
function partWithJointSpeed(share: number, header: Record<string, unknown> = {}): ReplayPart {
  const samples = 3;
  const row = (name: string, value: (k: number) => number): TestColumn => ({
    name,
    scale: 1e-7,
    values: Array.from({ length: samples }, (_, k) => value(k)),
  });
  const motion = decodeMotion(
    encode({ samples, ...header }, [
      row("puck_x", (k) => 0.1 * k),
      row("puck_y", () => 0),
      ...MODEL.initial_q_rad.map((q, i) => row(`q_${i + 1}`, () => q)),
      ...MODEL.initial_q_rad.map((_, i) =>
        row(`dq_${i + 1}`, () => (i === 3 ? -share * VELOCITY_LIMITS[3] : 0)),
      ),
    ]),
  );
  const interpolation = new Interpolation(motion);
  return {
    index: 0,
    motion,
    observed: null,
    observationError: null,
    interpolation,
    paths: pathsOf(motion, interpolation, null),
  };
}

describe("strips", () => {
  it("show margins and shares as in the rules", () => {
    const series = seriesOf(partWithJointSpeed(0.5), 0);
    expect(series.map((one) => [one.title, one.valueText(1)])).toEqual([
      ["End effector height: margin", "20.0 mm"],
      ["Edge of the table: margin", "66 mm"],
      ["Elbow and wrist height: margin", expect.stringMatching(/^\d+ mm$/)],
      ["Joint positions: smallest margin", "0.146 rad"],
      ["Joint velocities: smallest margin", "0.59 rad/s"],
      ["Joint speeds, share of limit", "joint 4: 50 %"],
    ]);
  });

  it("mark values beyond the limit and list recorded violations", () => {
    const violations = [{ side: 0, group: "joint_vel", from: 0, to: 2, worst: 0.1 }];
    const velocity = seriesOf(partWithJointSpeed(1, { violations }), 0)[4];
    expect(velocity.valueText(0)).toBe("−0.07 rad/s ▲ beyond");
    expect(velocity.violations).toHaveLength(1);
    const [low, high] = rangeOf(velocity);
    expect(low).toBeLessThan(0);
    expect(high).toBe(0);
  });
});

describe("paths", () => {
  it("are found by position", () => {
    const { puck } = partWithJointSpeed(0).paths;
    expect([...puck.positions]).toEqual([0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2]);
    expect(pointsBetween(puck, 0.5, 1)).toEqual([2, 4]);
    expect(pointsBetween(puck, -Infinity, Infinity)).toEqual([0, 8]);
  });

  it("are interrupted at the end of a rally", () => {
    const game = partWithJointSpeed(0, {
      contest: "game",
      breaks: [{ sample: 0, what: "goal", by: 0, score: [1, 0] }],
    });
    expect([...game.paths.puck.gaps]).toEqual([1, 1, 1, 1, 0, 0, 0, 0, 0]);
  });
});

it("rims leave the goal open and have the width of the model", () => {
  const outline = rimOutline();
  expect(Math.min(...outline.map(([, y]) => y))).toBeCloseTo(0.125, 9);
  expect(Math.max(...outline.map(([x]) => x))).toBeCloseTo(1.064, 9);
  expect(outline).toContainEqual([0.974, 0.519]);
});
