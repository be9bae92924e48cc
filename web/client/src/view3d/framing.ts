// Where the camera must be to show certain points as large as possible.

import type { CameraPosition } from "../replay/fragment";

export interface Point3 {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** Shape of the picture: tangents of half its field of view, horizontally and vertically. */
export interface Field {
  readonly tanX: number;
  readonly tanY: number;
}

/** Least share of a picture's height for the table: a camera for no height, or less, would be nowhere. */
const LEAST_VISIBLE_SHARE = 0.1;

/** Field of view of a picture with this vertical angle and aspect ratio. */
export function fieldOf(verticalRad: number, aspect: number): Field {
  const tanY = Math.tan(verticalRad / 2);
  return { tanX: tanY * aspect, tanY };
}

/** Share of a picture's height for the table, above controls that cover some of it. They may be higher than a low picture. */
export function visibleShare(height: number, covered: number): number {
  return Math.max((height - covered) / height, LEAST_VISIBLE_SHARE);
}

/** Axes of a camera with these angles: to the right, upwards and backwards. */
export function cameraAxes(azimuth: number, elevation: number): { right: Point3; up: Point3; back: Point3 } {
  const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
  return {
    right: { x: -sa, y: ca, z: 0 },
    up: { x: -se * ca, y: -se * sa, z: ce },
    back: { x: ce * ca, y: ce * sa, z: se },
  };
}

/**
 * The nearest camera with these angles that shows all points, centred. `margin`: share of the picture's width and height
 * that stays free on each side.
 */
export function fit(
  points: readonly Point3[],
  azimuth: number,
  elevation: number,
  field: Field,
  margin: number,
): CameraPosition {
  const { right, up, back } = cameraAxes(azimuth, elevation);
  const tanX = field.tanX * (1 - 2 * margin);
  const tanY = field.tanY * (1 - 2 * margin);
  // A point at (u, v, w) along right, up and back is inside if |u − camera's u| ≤ (camera's w − w) tan, and likewise for v.
  // Each of the four edges is a bound on a sum or difference of the camera's coordinates.
  let [toRight, toLeft, above, below, depth] = [-Infinity, -Infinity, -Infinity, -Infinity, 0];
  for (const point of points) {
    const [u, v, w] = [dot(point, right), dot(point, up), dot(point, back)];
    toRight = Math.max(toRight, w * tanX + u);
    toLeft = Math.max(toLeft, w * tanX - u);
    above = Math.max(above, w * tanY + v);
    below = Math.max(below, w * tanY - v);
    depth += w / points.length;
  }
  const u = (toRight - toLeft) / 2;
  const v = (above - below) / 2;
  const w = Math.max((toRight + toLeft) / (2 * tanX), (above + below) / (2 * tanY));
  return {
    x: u * right.x + v * up.x + depth * back.x,
    y: u * right.y + v * up.y + depth * back.y,
    z: u * right.z + v * up.z + depth * back.z,
    azimuth,
    elevation,
    distance: w - depth,
  };
}

export function dot(a: Point3, b: Point3): number {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/** Corners of a box. */
export function corners(x: readonly number[], y: readonly number[], z: readonly number[]): Point3[] {
  return x.flatMap((px) => y.flatMap((py) => z.map((pz) => ({ x: px, y: py, z: pz }))));
}
