// Trails, and colours and sizes that make things visible.

import { describe, expect, it } from "vitest";
import type { Path } from "../src/motion/paths";
import { freshness } from "../src/motion/taper";
import { quieter } from "../src/replay/palette";
import { haloScale } from "../src/view3d/puck";
import { bandGeometry } from "../src/view3d/ribbon";

/** A path through points of the table at positions 0, 1, 2 …. */
function path(points: readonly (readonly [number, number])[], gaps: readonly number[] = []): Path {
  return {
    positions: Float64Array.from(points.keys()),
    points: Float32Array.from(points.flatMap(([x, y]) => [x, y, 0])),
    gaps: Uint8Array.from(points, (_, i) => (gaps.includes(i) ? 1 : 0)),
  };
}

/** Offsets from the path of the corners of a segment. */
function sides(path: Path, segment: number): [number, number][] {
  const side = bandGeometry(path).getAttribute("side");
  return [0, 1, 2, 3].map((corner) => [side.getX(4 * segment + corner), side.getY(4 * segment + corner)]);
}

describe("a trail", () => {
  it("fades from its new end to its old end", () => {
    expect(freshness(10, 0, 10)).toBe(1);
    expect(freshness(5, 0, 10)).toBe(0.5);
    expect(freshness(-1, 0, 10)).toBe(0);
    expect(freshness(3, 5, 5)).toBe(0);
  });

  it("does not fade if the whole path is shown", () => {
    expect(freshness(0, -Infinity, Infinity)).toBe(1);
  });

  it("has a band of constant width around a bend", () => {
    const bend = path([[0, 0], [1, 0], [2, 1]]); // prettier-ignore
    const [, , left] = sides(bend, 0);
    const [next] = sides(bend, 1);
    expect(left[0]).toBeCloseTo(next[0], 6);
    expect(left[1]).toBeCloseTo(next[1], 6);
    // At a right angle to the first segment: half the width.
    expect(left[1]).toBeCloseTo(1, 6);
  });

  it("is interrupted at a bounce and at a gap", () => {
    const bounce = path([[0, 0], [1, 1], [2, 0], [3, 0]], [2]); // prettier-ignore
    const [, , left] = sides(bounce, 0);
    expect(left[0]).toBeCloseTo(-Math.SQRT1_2, 6);
    expect(left[1]).toBeCloseTo(Math.SQRT1_2, 6);
    expect(sides(bounce, 2).flat().every((part) => part === 0)).toBe(true); // prettier-ignore
  });
});

describe("visibility", () => {
  it("the halo grows when pixels are large", () => {
    expect(haloScale(0.0005)).toBe(1);
    expect(haloScale(0.02)).toBeCloseTo(2 * haloScale(0.01), 9);
    expect(haloScale(0.01)).toBeGreaterThan(1);
  });

  it("the opponent's colours are less saturated", () => {
    expect(quieter("#ff0000")).toBe("#9b1b1b");
    expect(quieter("#777777")).toBe("#777777");
    expect(quieter("rgb(1 2 3)")).toBe("rgb(1 2 3)");
  });
});
