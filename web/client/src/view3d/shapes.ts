// Basic shapes of the 3-D view. Lengths are in metres.

import {
  BoxGeometry,
  CylinderGeometry,
  LatheGeometry,
  SphereGeometry,
  Vector2,
  Vector3,
  Quaternion,
  type BufferGeometry,
} from "three";

const Y = new Vector3(0, 1, 0);

/** A tapered round bar from one point to another. */
export function bar(
  from: Vector3,
  to: Vector3,
  fromRadius: number,
  toRadius: number,
  sides = 28,
): BufferGeometry {
  const along = to.clone().sub(from);
  const length = along.length();
  const geometry = new CylinderGeometry(toRadius, fromRadius, length, sides);
  geometry.applyQuaternion(new Quaternion().setFromUnitVectors(Y, along.normalize()));
  const middle = from.clone().add(to).multiplyScalar(0.5);
  return geometry.translate(middle.x, middle.y, middle.z);
}

/** A cylinder about z with bevelled edges, between two heights. */
export function drum(radius: number, from: number, to: number, bevel: number): BufferGeometry {
  const profile = [
    [0, from],
    [radius - bevel, from],
    [radius - 0.3 * bevel, from + 0.3 * bevel],
    [radius, from + bevel],
    [radius, to - bevel],
    [radius - 0.3 * bevel, to - 0.3 * bevel],
    [radius - bevel, to],
    [0, to],
  ].map(([x, y]) => new Vector2(x, y));
  // The lathe rotates about y; rotate the axis to z.
  return new LatheGeometry(profile, 40).rotateX(Math.PI / 2);
}

export function ball(radius: number): BufferGeometry {
  return new SphereGeometry(radius, 28, 18);
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
