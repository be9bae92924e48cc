import type { Camera } from "../replay/fragment";

/** Camera position: a target, and angles and distance around it. */
interface CameraPosition {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly azimuth: number;
  readonly elevation: number;
  readonly distance: number;
}

const DEG = Math.PI / 180;

const PRESETS: Record<Camera, CameraPosition> = {
  corner: { x: -0.27, y: 0, z: 0.08, azimuth: -58 * DEG, elevation: 30 * DEG, distance: 4.0 },
  side: { x: -0.3, y: 0, z: 0.2, azimuth: -90 * DEG, elevation: 14 * DEG, distance: 3.6 },
  robot: { x: -0.16, y: 0, z: 0, azimuth: 180 * DEG, elevation: 62 * DEG, distance: 3.6 },
  above: { x: -0.34, y: 0, z: 0, azimuth: -90 * DEG, elevation: 89.5 * DEG, distance: 3.6 },
};

const SMALL_TURN = 15 * DEG;
const RADIANS_PER_PIXEL = 0.006;
const WIDER = 1.2;
const TURN_MS = 350;
const ELEVATION = [2 * DEG, 89.5 * DEG] as const;
const DISTANCE = [0.6, 9] as const;

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
  private from: CameraPosition | null = null;
  private to: CameraPosition = PRESETS.corner;
  private startedMs = 0;
  private wide = false;

  /** `still`: the visitor prefers reduced motion. */
  constructor(
    private readonly still: boolean,
    private readonly changed: () => void,
  ) {
    this.moveTo(PRESETS.corner);
  }

  preset(camera: Camera): void {
    this.camera = camera;
    this.go(this.position(camera));
  }

  /** Widens the view for a second arm; moves the camera at once if it is at a preset. */
  widen(): void {
    if (this.wide) return;
    this.wide = true;
    if (this.camera === null) return;
    this.from = null;
    this.to = this.position(this.camera);
    this.moveTo(this.to);
  }

  turn(right: number, up: number): void {
    this.camera = null;
    this.go(this.turned(this.to, right * SMALL_TURN, up * SMALL_TURN, 1));
  }

  closer(steps: number): void {
    this.camera = null;
    this.go(this.turned(this.to, 0, 0, 0.85 ** steps));
  }

  /** Turns by pointer movement in pixels, without animation. */
  drag(dx: number, dy: number): void {
    this.camera = null;
    this.from = null;
    this.to = this.turned(this, -dx * RADIANS_PER_PIXEL, dy * RADIANS_PER_PIXEL, 1);
    this.moveTo(this.to);
    this.changed();
  }

  /** Continues the animation; true until it is finished. */
  tick(nowMs: number): boolean {
    const { from, to } = this;
    if (from === null) return false;
    if (this.startedMs === 0) this.startedMs = nowMs;
    const share = Math.min((nowMs - this.startedMs) / TURN_MS, 1);
    const s = share * share * (3 - 2 * share);
    this.x = from.x + (to.x - from.x) * s;
    this.y = from.y + (to.y - from.y) * s;
    this.z = from.z + (to.z - from.z) * s;
    this.azimuth = from.azimuth + (to.azimuth - from.azimuth) * s;
    this.elevation = from.elevation + (to.elevation - from.elevation) * s;
    this.distance = from.distance + (to.distance - from.distance) * s;
    if (share === 1) this.from = null;
    return share < 1;
  }

  private position(camera: Camera): CameraPosition {
    const position = PRESETS[camera];
    if (!this.wide || camera === "robot") return position;
    return { ...position, x: 0, distance: position.distance * WIDER };
  }

  private go(position: CameraPosition): void {
    // Turn the shorter way.
    const turns = Math.round((this.azimuth - position.azimuth) / (2 * Math.PI));
    this.to = { ...position, azimuth: position.azimuth + turns * 2 * Math.PI };
    if (this.still) {
      this.from = null;
      this.moveTo(this.to);
    } else {
      const { x, y, z, azimuth, elevation, distance } = this;
      this.from = { x, y, z, azimuth, elevation, distance };
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
      elevation: clamp(position.elevation + elevation, ELEVATION),
      distance: clamp(position.distance * distance, DISTANCE),
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
