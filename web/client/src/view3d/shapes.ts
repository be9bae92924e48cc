// Basic shapes of the 3-D view. Lengths are in metres.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  LatheGeometry,
  RingGeometry,
  SphereGeometry,
  Vector2,
} from "three";

/** A point of a profile: distance from the axis, and position along it. */
export type ProfilePoint = readonly [radius: number, along: number];

/** Steps of which a rounded edge is made. */
const ROUND_STEPS = 3;

/** A shape about z from its profile, which runs from low to high z. */
export function latheShape(profile: readonly ProfilePoint[], sides = 24): BufferGeometry {
  // The lathe rotates about y; rotate the axis to z.
  const points = profile.map(([radius, along]) => new Vector2(radius, along));
  return new LatheGeometry(points, sides).rotateX(Math.PI / 2);
}

/** A cylinder or frustum about z with rounded edges, between two heights. */
export function drum(
  fromRadius: number,
  from: number,
  to: number,
  round: number,
  toRadius = fromRadius,
  sides = 24,
): BufferGeometry {
  const profile: ProfilePoint[] = [[0, from]];
  for (let i = 0; i <= ROUND_STEPS; i++) {
    const angle = (i / ROUND_STEPS) * (Math.PI / 2);
    profile.push([fromRadius - round + round * Math.sin(angle), from + round - round * Math.cos(angle)]);
  }
  for (let i = 0; i <= ROUND_STEPS; i++) {
    const angle = (i / ROUND_STEPS) * (Math.PI / 2);
    profile.push([toRadius - round + round * Math.cos(angle), to - round + round * Math.sin(angle)]);
  }
  profile.push([0, to]);
  return latheShape(profile, sides);
}

/**
 * The housing of a limb about z: from a flat end at 0 with one radius over a narrower waist to a round end about `length`
 * with another.
 */
export function limb(length: number, fromRadius: number, waist: number, toRadius: number): BufferGeometry {
  const profile: ProfilePoint[] = [
    [0, 0],
    [fromRadius - 0.006, 0],
    [fromRadius - 0.0015, 0.0015],
    [fromRadius, 0.006],
  ];
  const steps = 7;
  for (let i = 1; i <= steps; i++) {
    const share = i / steps;
    // The waist is smooth at both ends.
    const dip = Math.sin(Math.PI * share) ** 2;
    const straight = fromRadius + (toRadius - fromRadius) * share * share * (3 - 2 * share);
    profile.push([straight + (waist - straight) * dip, 0.006 + (length - 0.006) * share]);
  }
  for (let i = 1; i <= 6; i++) {
    const angle = (i / 6) * (Math.PI / 2);
    profile.push([toRadius * Math.cos(angle), length + toRadius * Math.sin(angle)]);
  }
  return latheShape(profile);
}

export function ball(radius: number): BufferGeometry {
  return new SphereGeometry(radius, 20, 12);
}

/** A flat mark on a surface, between two points. */
export function mark(
  x0: number,
  y0: number,
  x1: number,
  y1: number,
  width: number,
  z: number,
): BufferGeometry {
  const geometry = new BoxGeometry(Math.hypot(x1 - x0, y1 - y0), width, 0.0005);
  return geometry.rotateZ(Math.atan2(y1 - y0, x1 - x0)).translate((x0 + x1) / 2, (y0 + y1) / 2, z);
}

/** A flat arc on a surface; the angles are in radians from the x axis. */
export function arc(
  x: number,
  y: number,
  radius: number,
  width: number,
  z: number,
  start: number,
  length: number,
): BufferGeometry {
  const half = width / 2;
  return new RingGeometry(radius - half, radius + half, 64, 1, start, length).translate(x, y, z);
}

/** A horizontal sheet with vertices at all pairs of `xs` and `ys`, which ascend. */
export function sheet(xs: readonly number[], ys: readonly number[], z: number): BufferGeometry {
  const geometry = new BufferGeometry();
  const positions = ys.flatMap((y) => xs.flatMap((x) => [x, y, z]));
  const normals = ys.flatMap(() => xs.flatMap(() => [0, 0, 1]));
  const index: number[] = [];
  for (let row = 0; row + 1 < ys.length; row++) {
    for (let column = 0; column + 1 < xs.length; column++) {
      const a = row * xs.length + column;
      const b = a + xs.length;
      index.push(a, a + 1, b, b, a + 1, b + 1);
    }
  }
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(normals), 3));
  geometry.setIndex(index);
  return geometry;
}
