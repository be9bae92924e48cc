// Reduction of the rendering quality on slow machines.

import { expect, it } from "vitest";
import { RenderQuality } from "../src/view3d/quality";

it("quality drops on slow frames but not after a pause", () => {
  const quality = new RenderQuality();
  let now = 0;
  const frames = (count: number, ms: number): boolean[] =>
    Array.from({ length: count }, () => quality.recordFrame((now += ms)));
  expect(frames(100, 17)).not.toContain(true);
  expect(frames(20, 5000)).not.toContain(true);
  expect(quality.shadows).toBe(true);
  expect(frames(8, 100)).toContain(true);
  expect(quality.shadows).toBe(false);
  frames(100, 100);
  expect(quality.ratio).toBeLessThan(1);
  expect(frames(100, 100)).not.toContain(true);
});
