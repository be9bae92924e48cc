// Framing of the table, cameras, and two-finger gestures.

import { describe, expect, it } from "vitest";
import { CAMERAS } from "../src/replay/fragment";
import type { CameraPosition } from "../src/replay/fragment";
import { cameraAxes, dot, fieldOf, fit, visibleShare, type Point3 } from "../src/view3d/framing";
import { Orbit } from "../src/view3d/orbit";
import { pinchOf } from "../src/view3d/pointer";
import { cameraPosition, followedPoint, pointsOf } from "../src/view3d/scenes";

const VERTICAL_RAD = (28 * Math.PI) / 180;
/** From a small phone to a large window. */
const SHAPES = [
  [390, 300],
  [300, 390],
  [768, 512],
  [1440, 810],
  [1600, 500],
] as const;

/** Where a point is in the picture: −1 to 1 from left to right and from bottom to top. */
function projected(point: Point3, camera: CameraPosition, aspect: number): [number, number] {
  const { right, up, back } = cameraAxes(camera.azimuth, camera.elevation);
  const { tanX, tanY } = fieldOf(VERTICAL_RAD, aspect);
  const at = { x: point.x - camera.x, y: point.y - camera.y, z: point.z - camera.z };
  const ahead = camera.distance - dot(at, back);
  expect(ahead).toBeGreaterThan(0);
  return [dot(at, right) / (ahead * tanX), dot(at, up) / (ahead * tanY)];
}

describe("the camera", () => {
  it("shows table and arms at any shape of the picture", () => {
    for (const [width, height] of SHAPES) {
      const aspect = width / height;
      for (const arms of [1, 2]) {
        for (const name of CAMERAS) {
          const camera = cameraPosition(name, arms, fieldOf(VERTICAL_RAD, aspect));
          const places = pointsOf(name, arms).map((point) => projected(point, camera, aspect));
          const xs = places.map(([x]) => x);
          const ys = places.map(([, y]) => y);
          const largest = Math.max(...xs.map(Math.abs), ...ys.map(Math.abs));
          expect(largest, `${name} ${width}x${height}`).toBeLessThan(0.95);
          // Closer, something would be outside.
          const [width2, height2] = [Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys)];
          expect(Math.max(width2, height2), `${name} ${width}x${height}`).toBeGreaterThan(1.6);
        }
      }
    }
  });

  it("is as near as the margin allows", () => {
    const points = [
      { x: -1, y: -2, z: 0 },
      { x: 1, y: 2, z: 0 },
      { x: 0, y: 0, z: 1 },
    ];
    const camera = fit(points, -1.1, 0.5, fieldOf(VERTICAL_RAD, 1.5), 0.1);
    const largest = Math.max(...points.flatMap((point) => projected(point, camera, 1.5).map(Math.abs)));
    expect(largest).toBeCloseTo(0.8, 9);
  });

  it("follows the puck and comes to rest", () => {
    const orbit = new Orbit(false, () => undefined);
    orbit.frame(fieldOf(VERTICAL_RAD, 1.6), 2);
    orbit.preset("follow");
    const puck = { x: 0.7, y: -0.3 };
    const goal = followedPoint(puck.x, puck.y);
    let previous = Math.hypot(orbit.x - goal.x, orbit.y - goal.y);
    let frames = 0;
    while (orbit.tick(1000 + frames * 16, puck)) {
      const distance = Math.hypot(orbit.x - goal.x, orbit.y - goal.y);
      expect(distance).toBeLessThanOrEqual(previous);
      previous = distance;
      expect(++frames).toBeLessThan(1000);
    }
    // Not with a jump.
    expect(frames).toBeGreaterThan(20);
    expect([orbit.x, orbit.y]).toEqual([goal.x, goal.y]);
    // Turning by hand does not end it; another camera does.
    orbit.turn(1, 0);
    expect(orbit.camera).toBe("follow");
    orbit.preset("side");
    while (orbit.tick(1e5 + frames * 16, puck)) frames++;
    expect(orbit.x).not.toBeCloseTo(goal.x, 2);
  });

  it("keeps what was zoomed by hand when the picture changes", () => {
    const orbit = new Orbit(true, () => undefined);
    orbit.frame(fieldOf(VERTICAL_RAD, 1.6), 2);
    orbit.zoom(3);
    const near = orbit.distance;
    orbit.frame(fieldOf(VERTICAL_RAD, 0.8), 2);
    expect(orbit.distance).toBeGreaterThan(near);
    orbit.frame(fieldOf(VERTICAL_RAD, 1.6), 2);
    expect(orbit.distance).toBeCloseTo(near, 9);
  });

  it("follows as turned by hand when the picture changes", () => {
    const orbit = new Orbit(true, () => undefined);
    orbit.frame(fieldOf(VERTICAL_RAD, 1.6), 2);
    orbit.preset("follow");
    orbit.tick(1000, { x: 0.7, y: -0.3 });
    const selected = { azimuth: orbit.azimuth, elevation: orbit.elevation, distance: orbit.distance };
    orbit.turn(2, 1);
    orbit.zoom(2);
    const { x, y, azimuth, elevation, distance } = orbit;
    expect(azimuth).not.toBeCloseTo(selected.azimuth, 2);
    orbit.frame(fieldOf(VERTICAL_RAD, 0.8), 2);
    expect(orbit.camera).toBe("follow");
    expect([orbit.x, orbit.y, orbit.azimuth, orbit.elevation]).toEqual([x, y, azimuth, elevation]);
    expect(orbit.distance).toBeGreaterThan(distance);
    orbit.frame(fieldOf(VERTICAL_RAD, 1.6), 2);
    expect(orbit.distance).toBeCloseTo(distance, 9);
    // Selected again, it is as it was.
    orbit.preset("follow");
    expect(orbit.distance).toBeCloseTo(selected.distance, 9);
    const tall = fieldOf(VERTICAL_RAD, 0.8);
    orbit.frame(tall, 2);
    expect(orbit.elevation).toBeCloseTo(selected.elevation, 9);
    expect(orbit.distance).toBeCloseTo(cameraPosition("follow", 2, tall).distance, 9);
  });

  it("has a place also if controls cover the picture", () => {
    expect(visibleShare(400, 100)).toBe(0.75);
    for (const covered of [100, 120]) {
      const { tanX, tanY } = fieldOf(VERTICAL_RAD, 5);
      const field = { tanX, tanY: tanY * visibleShare(100, covered) };
      const { distance } = cameraPosition("corner", 2, field);
      expect(distance).toBeGreaterThan(0);
      expect(distance).toBeLessThan(Infinity);
    }
  });
});

describe("two fingers", () => {
  it("zoom by their distance and turn by their angle", () => {
    expect(pinchOf({ x: 10, y: 0 }, { x: 20, y: 0 })).toEqual({ angle: 0, factor: 2 });
    const quarter = pinchOf({ x: 10, y: 0 }, { x: 0, y: 5 });
    expect(quarter.angle).toBeCloseTo(Math.PI / 2, 12);
    expect(quarter.factor).toBeCloseTo(0.5, 12);
    expect(pinchOf({ x: 0, y: 0 }, { x: 1, y: 1 })).toEqual({ angle: 0, factor: 1 });
  });

  it("move the table with them", () => {
    const orbit = new Orbit(true, () => undefined);
    orbit.frame(fieldOf(VERTICAL_RAD, 1.6), 2);
    orbit.preset("side");
    const { x, distance } = orbit;
    orbit.pinch(50, 0, 0, 2, 500);
    // The side camera looks along y: to the right is x, and the table follows the fingers.
    expect(orbit.x).toBeLessThan(x);
    expect(orbit.distance).toBeCloseTo(distance / 2, 9);
    expect(orbit.camera).toBeNull();
  });
});
