import type { Camera } from "../replay/fragment";

/** A camera's place: it looks at a target from a distance, in angles about it. */
interface Seat {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly azimuth: number;
  readonly elevation: number;
  readonly distance: number;
}

const DEG = Math.PI / 180;

const SEATS: Record<Camera, Seat> = {
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

/** Where the camera is, and how it gets from place to place. */
export class Orbit {
  x = 0;
  y = 0;
  z = 0;
  azimuth = 0;
  elevation = 0;
  distance = 1;
  /** The chosen place; null once it was turned by hand. */
  camera: Camera | null = "corner";
  private from: Seat | null = null;
  private to: Seat = SEATS.corner;
  private startedMs = 0;
  private wide = false;

  /** `still`: the reader wants no motion beside the replay's own. */
  constructor(
    private readonly still: boolean,
    private readonly changed: () => void,
  ) {
    this.settle(SEATS.corner);
  }

  preset(camera: Camera): void {
    this.camera = camera;
    this.go(this.seat(camera));
  }

  /** Makes room for a second arm; the camera goes there at once if it stands at a chosen place. */
  widen(): void {
    if (this.wide) return;
    this.wide = true;
    if (this.camera === null) return;
    this.from = null;
    this.to = this.seat(this.camera);
    this.settle(this.to);
  }

  turn(right: number, up: number): void {
    this.camera = null;
    this.go(this.turned(this.to, right * SMALL_TURN, up * SMALL_TURN, 1));
  }

  closer(steps: number): void {
    this.camera = null;
    this.go(this.turned(this.to, 0, 0, 0.85 ** steps));
  }

  /** By a pointer that moved so many pixels: at once. */
  drag(dx: number, dy: number): void {
    this.camera = null;
    this.from = null;
    this.to = this.turned(this, -dx * RADIANS_PER_PIXEL, dy * RADIANS_PER_PIXEL, 1);
    this.settle(this.to);
    this.changed();
  }

  /** Moves on towards the chosen place; true while it is under way. */
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

  private seat(camera: Camera): Seat {
    const seat = SEATS[camera];
    if (!this.wide || camera === "robot") return seat;
    return { ...seat, x: 0, distance: seat.distance * WIDER };
  }

  private go(seat: Seat): void {
    // The short way round.
    const turns = Math.round((this.azimuth - seat.azimuth) / (2 * Math.PI));
    this.to = { ...seat, azimuth: seat.azimuth + turns * 2 * Math.PI };
    if (this.still) {
      this.from = null;
      this.settle(this.to);
    } else {
      const { x, y, z, azimuth, elevation, distance } = this;
      this.from = { x, y, z, azimuth, elevation, distance };
      this.startedMs = 0;
    }
    this.changed();
  }

  private turned(seat: Seat, azimuth: number, elevation: number, distance: number): Seat {
    return {
      x: seat.x,
      y: seat.y,
      z: seat.z,
      azimuth: seat.azimuth + azimuth,
      elevation: clamp(seat.elevation + elevation, ELEVATION),
      distance: clamp(seat.distance * distance, DISTANCE),
    };
  }

  private settle(seat: Seat): void {
    this.x = seat.x;
    this.y = seat.y;
    this.z = seat.z;
    this.azimuth = seat.azimuth;
    this.elevation = seat.elevation;
    this.distance = seat.distance;
  }
}

function clamp(value: number, [low, high]: readonly [number, number]): number {
  return Math.min(Math.max(value, low), high);
}
