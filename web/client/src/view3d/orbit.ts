// The camera of the 3-D view, which moves on a sphere around a point of the table.

import type { Camera, CameraPosition } from "../replay/fragment";
import { cameraAxes, type Field } from "./framing";
import { cameraPosition, followedPoint } from "./scenes";

const RAD_PER_DEG = Math.PI / 180;
const TURN_STEP_RAD = 15 * RAD_PER_DEG;
/** Distance after a zoom step, relative to the distance before. */
const ZOOM_FACTOR = 0.85;
const RADIANS_PER_PIXEL = 0.006;
const ANIMATION_MS = 350;
/** Time in which the camera makes up for most of its distance from the puck that it follows. */
const FOLLOW_MS = 220;
/** A longer time between two frames is a pause. */
const LONGEST_FRAME_MS = 100;
/** The camera rests when it is closer than this, m. */
const RESTING_M = 0.001;
const ELEVATION_RANGE_RAD = [2 * RAD_PER_DEG, 89.5 * RAD_PER_DEG] as const;
const DISTANCE_RANGE_M = [0.6, 25] as const;
/** How far from the middle of the table the camera may look, m. */
const PAN_RANGE_M = [-1.6, 1.6] as const;

/** The camera with its animated movements. */
export class Orbit implements CameraPosition {
  x = 0;
  y = 0;
  z = 0;
  azimuth = 0;
  elevation = 0;
  distance = 1;
  /** The selected camera; null after manual movement. */
  camera: Camera | null = "corner";
  private animationStart: CameraPosition | null = null;
  private target: CameraPosition;
  private startedMs = 0;
  private previousMs = -Infinity;
  /** Arms on the table. */
  private arms = 1;
  private field: Field = { tanX: 0.4, tanY: 0.25 };
  /** Is the camera where a link has put it? */
  private isOfLink = false;
  /** Was the camera moved by hand since it was selected? */
  private isByHand = false;

  /** `prefersReducedMotion`: the camera jumps. */
  constructor(
    private readonly prefersReducedMotion: boolean,
    private readonly changed: () => void,
  ) {
    this.target = cameraPosition("corner", this.arms, this.field);
    this.moveTo(this.target);
  }

  preset(camera: Camera): void {
    this.camera = camera;
    this.isByHand = false;
    const position = cameraPosition(camera, this.arms, this.field);
    // The camera that follows starts from where it looks; `tick` leads it to the puck.
    this.animateTo(camera === "follow" ? { ...position, x: this.x, y: this.y } : position);
  }

  /** Moves the camera to a position of a link. */
  restore(position: CameraPosition): void {
    this.camera = null;
    this.isOfLink = true;
    this.animateTo(this.movedPosition(position, 0, 0, 1));
  }

  /** Fits the picture to another shape or number of arms, at once. */
  frame(field: Field, arms: number): void {
    // What was turned and zoomed by hand keeps its share of the picture when its shape changes. A position of a link holds as it is,
    // since the picture gets its shape after the link was read.
    const isReshaped = !this.isOfLink && arms === this.arms;
    const before = cameraPosition("corner", this.arms, this.field).distance;
    const factor = isReshaped ? cameraPosition("corner", arms, field).distance / before : 1;
    this.field = field;
    this.arms = arms;
    this.animationStart = null;
    if (this.camera === null || this.isByHand) {
      this.target = this.movedPosition(this.target, 0, 0, factor);
    } else {
      const position = cameraPosition(this.camera, arms, field);
      const { x, y } = this;
      this.target = this.camera === "follow" ? { ...position, x, y } : position;
    }
    this.moveTo(this.target);
  }

  turn(right: number, up: number): void {
    this.leavePreset();
    this.animateTo(this.movedPosition(this.target, right * TURN_STEP_RAD, up * TURN_STEP_RAD, 1));
  }

  zoom(steps: number): void {
    this.leavePreset();
    this.animateTo(this.movedPosition(this.target, 0, 0, ZOOM_FACTOR ** steps));
  }

  /** Turns by pointer movement in pixels, without animation. */
  drag(dx: number, dy: number): void {
    this.leavePreset();
    this.jumpTo(this.movedPosition(this, -dx * RADIANS_PER_PIXEL, dy * RADIANS_PER_PIXEL, 1));
  }

  /**
   * Moves with two fingers, without animation: by pixels over the table, by an angle about the vertical, and nearer by a
   * factor. `height`: height of the picture in pixels.
   */
  pinch(dx: number, dy: number, angle: number, factor: number, height: number): void {
    const metresPerPixel = (2 * this.distance * this.field.tanY) / height;
    const position = this.movedPosition(this, angle, 0, 1 / factor);
    this.leavePreset();
    const { right, back } = cameraAxes(this.azimuth, 0);
    // Seen flatly, a pixel covers more of the table, up to three times.
    const away = dy / Math.max(Math.sin(this.elevation), 1 / 3);
    this.jumpTo({
      ...position,
      x: clamp(position.x - (dx * right.x + away * back.x) * metresPerPixel, PAN_RANGE_M),
      y: clamp(position.y - (dx * right.y + away * back.y) * metresPerPixel, PAN_RANGE_M),
    });
  }

  /** Continues the animation and follows the puck; true until both are finished. */
  tick(nowMs: number, puck: { readonly x: number; readonly y: number }): boolean {
    const frameMs = Math.min(nowMs - this.previousMs, LONGEST_FRAME_MS);
    this.previousMs = nowMs;
    const isFollowing = this.camera === "follow" && this.follow(frameMs, puck);
    return this.animate(nowMs) || isFollowing;
  }

  /** Leads the point that the camera looks at to the puck; true until it is there. */
  private follow(frameMs: number, puck: { readonly x: number; readonly y: number }): boolean {
    const goal = followedPoint(puck.x, puck.y);
    const share = this.prefersReducedMotion ? 1 : 1 - Math.exp(-frameMs / FOLLOW_MS);
    const x = this.x + (goal.x - this.x) * share;
    const y = this.y + (goal.y - this.y) * share;
    const isThere = Math.hypot(goal.x - x, goal.y - y) < RESTING_M;
    this.x = isThere ? goal.x : x;
    this.y = isThere ? goal.y : y;
    this.target = { ...this.target, x: this.x, y: this.y };
    return !isThere;
  }

  private animate(nowMs: number): boolean {
    const { animationStart: from, target: to } = this;
    if (from === null) return false;
    if (this.startedMs === 0) this.startedMs = nowMs;
    const share = Math.min((nowMs - this.startedMs) / ANIMATION_MS, 1);
    const s = share * share * (3 - 2 * share);
    if (this.camera !== "follow") {
      this.x = from.x + (to.x - from.x) * s;
      this.y = from.y + (to.y - from.y) * s;
    }
    this.z = from.z + (to.z - from.z) * s;
    this.azimuth = from.azimuth + (to.azimuth - from.azimuth) * s;
    this.elevation = from.elevation + (to.elevation - from.elevation) * s;
    this.distance = from.distance + (to.distance - from.distance) * s;
    if (share === 1) this.animationStart = null;
    return share < 1;
  }

  /** Turning and zooming by hand leave the presets, but the camera that follows keeps following. */
  private leavePreset(): void {
    this.isOfLink = false;
    this.isByHand = true;
    if (this.camera !== "follow") this.camera = null;
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

  private jumpTo(position: CameraPosition): void {
    this.animationStart = null;
    this.target = position;
    this.moveTo(position);
    this.changed();
  }

  /** A camera position after a turn by two angles (rad) and a change of the distance by a factor, within the camera's ranges. */
  private movedPosition(
    position: CameraPosition,
    azimuthChange: number,
    elevationChange: number,
    distanceFactor: number,
  ): CameraPosition {
    return {
      x: position.x,
      y: position.y,
      z: position.z,
      azimuth: position.azimuth + azimuthChange,
      elevation: clamp(position.elevation + elevationChange, ELEVATION_RANGE_RAD),
      distance: clamp(position.distance * distanceFactor, DISTANCE_RANGE_M),
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
