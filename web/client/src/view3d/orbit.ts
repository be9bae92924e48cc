// The camera of the 3-D view, which moves on a sphere around a point of the table.

import type { Camera, CameraPosition } from "../replay/fragment";

const RAD_PER_DEG = Math.PI / 180;

const PRESETS: Record<Camera, CameraPosition> = {
  corner: { x: -0.27, y: 0, z: 0.08, azimuth: -58 * RAD_PER_DEG, elevation: 30 * RAD_PER_DEG, distance: 4.0 },
  side: { x: -0.3, y: 0, z: 0.2, azimuth: -90 * RAD_PER_DEG, elevation: 14 * RAD_PER_DEG, distance: 3.6 },
  robot: { x: -0.16, y: 0, z: 0, azimuth: 180 * RAD_PER_DEG, elevation: 62 * RAD_PER_DEG, distance: 3.6 },
  above: { x: -0.34, y: 0, z: 0, azimuth: -90 * RAD_PER_DEG, elevation: 89.5 * RAD_PER_DEG, distance: 3.6 },
};

const TURN_STEP_RAD = 15 * RAD_PER_DEG;
/** Distance after a zoom step, relative to the distance before. */
const ZOOM_FACTOR = 0.85;
const RADIANS_PER_PIXEL = 0.006;
/** With a second arm the camera is farther away. */
const TWO_ARM_DISTANCE_FACTOR = 1.2;
const ANIMATION_MS = 350;
const ELEVATION_RANGE_RAD = [2 * RAD_PER_DEG, 89.5 * RAD_PER_DEG] as const;
const DISTANCE_RANGE_M = [0.6, 9] as const;

/** The camera with its animated movements. */
export class Orbit {
  x = 0;
  y = 0;
  z = 0;
  azimuth = 0;
  elevation = 0;
  distance = 1;
  /** The selected preset; null after manual turning. */
  camera: Camera | null = "corner";
  private animationStart: CameraPosition | null = null;
  private target: CameraPosition = PRESETS.corner;
  private startedMs = 0;
  private hasTwoArms = false;

  /** `still`: the visitor prefers reduced motion. */
  constructor(
    private readonly prefersReducedMotion: boolean,
    private readonly changed: () => void,
  ) {
    this.moveTo(PRESETS.corner);
  }

  preset(camera: Camera): void {
    this.camera = camera;
    this.animateTo(this.presetPosition(camera));
  }

  /** Moves the camera to a position of a link. */
  restore(position: CameraPosition): void {
    this.camera = null;
    this.animateTo(this.turned(position, 0, 0, 1));
  }

  /** Widens the view for a second arm; moves the camera at once if it is at a preset. */
  widen(): void {
    if (this.hasTwoArms) return;
    this.hasTwoArms = true;
    if (this.camera === null) return;
    this.animationStart = null;
    this.target = this.presetPosition(this.camera);
    this.moveTo(this.target);
  }

  turn(right: number, up: number): void {
    this.camera = null;
    this.animateTo(this.turned(this.target, right * TURN_STEP_RAD, up * TURN_STEP_RAD, 1));
  }

  zoom(steps: number): void {
    this.camera = null;
    this.animateTo(this.turned(this.target, 0, 0, ZOOM_FACTOR ** steps));
  }

  /** Turns by pointer movement in pixels, without animation. */
  drag(dx: number, dy: number): void {
    this.camera = null;
    this.animationStart = null;
    this.target = this.turned(this, -dx * RADIANS_PER_PIXEL, dy * RADIANS_PER_PIXEL, 1);
    this.moveTo(this.target);
    this.changed();
  }

  /** Continues the animation; true until it is finished. */
  tick(nowMs: number): boolean {
    const { animationStart: from, target: to } = this;
    if (from === null) return false;
    if (this.startedMs === 0) this.startedMs = nowMs;
    const share = Math.min((nowMs - this.startedMs) / ANIMATION_MS, 1);
    const s = share * share * (3 - 2 * share);
    this.x = from.x + (to.x - from.x) * s;
    this.y = from.y + (to.y - from.y) * s;
    this.z = from.z + (to.z - from.z) * s;
    this.azimuth = from.azimuth + (to.azimuth - from.azimuth) * s;
    this.elevation = from.elevation + (to.elevation - from.elevation) * s;
    this.distance = from.distance + (to.distance - from.distance) * s;
    if (share === 1) this.animationStart = null;
    return share < 1;
  }

  private presetPosition(camera: Camera): CameraPosition {
    const position = PRESETS[camera];
    if (!this.hasTwoArms || camera === "robot") return position;
    return { ...position, x: 0, distance: position.distance * TWO_ARM_DISTANCE_FACTOR };
  }

  private animateTo(position: CameraPosition): void {
    // Turn the shorter way.
    const turns = Math.round((this.azimuth - position.azimuth) / (2 * Math.PI));
    this.target = { ...position, azimuth: position.azimuth + turns * 2 * Math.PI };
    if (this.prefersReducedMotion) {
      this.animationStart = null;
      this.moveTo(this.target);
    } else {
      const { x, y, z, azimuth, elevation, distance } = this;
      this.animationStart = { x, y, z, azimuth, elevation, distance };
      this.startedMs = 0;
    }
    this.changed();
  }

  private turned(
    position: CameraPosition,
    azimuth: number,
    elevation: number,
    distance: number,
  ): CameraPosition {
    return {
      x: position.x,
      y: position.y,
      z: position.z,
      azimuth: position.azimuth + azimuth,
      elevation: clamp(position.elevation + elevation, ELEVATION_RANGE_RAD),
      distance: clamp(position.distance * distance, DISTANCE_RANGE_M),
    };
  }

  private moveTo(position: CameraPosition): void {
    this.x = position.x;
    this.y = position.y;
    this.z = position.z;
    this.azimuth = position.azimuth;
    this.elevation = position.elevation;
    this.distance = position.distance;
  }
}

function clamp(value: number, [low, high]: readonly [number, number]): number {
  return Math.min(Math.max(value, low), high);
}
