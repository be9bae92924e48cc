import { expect, it } from "vitest";
import { Effort } from "../src/view3d/effort";

it("asks a slow machine for less, and one that paused for the same", () => {
  const effort = new Effort();
  let now = 0;
  const frames = (count: number, ms: number): boolean[] =>
    Array.from({ length: count }, () => effort.tooSlow((now += ms)));
  expect(frames(100, 17)).not.toContain(true);
  expect(frames(20, 5000)).not.toContain(true);
  expect(effort.shadows).toBe(true);
  expect(frames(8, 100)).toContain(true);
  expect(effort.shadows).toBe(false);
  frames(100, 100);
  expect(effort.ratio).toBeLessThan(1);
  expect(frames(100, 100)).not.toContain(true);
});
