// The state that a view draws.

import type { Kinematics } from "../model/kinematics";
import type { Pose } from "../motion/pose";
import type { Palette } from "./palette";
import type { ReplayPart } from "./source";

/** Layers switched on by the visitor. */
export interface Layers {
  /** The observed puck. */
  seen: boolean;
  /** Actual paths of the mallets. */
  mallet: boolean;
  /** Commanded path of the mallet. */
  commanded: boolean;
  /** Path of the puck. */
  puck: boolean;
  /** Lines of the whole part instead of the last second only. */
  wholePart: boolean;
}

/** Length of the trail in seconds. */
export const TRAIL_S = 1;

/** State to draw. One instance is updated for each frame. */
export interface FrameState {
  part: ReplayPart;
  /** In control steps from sample 0. */
  position: number;
  readonly pose: Pose;
  /** The arms on the table, set to the pose. */
  readonly arms: readonly [Kinematics, Kinematics];
  readonly layers: Layers;
  /** Observed position of the puck; NaN without an observation. */
  seenX: number;
  seenY: number;
  /** The camera has lost the puck. */
  isPuckLost: boolean;
  /** Another replay that is drawn on the same table. */
  ghost: FrameState | null;
}

/** How puck and arm are drawn: solid, or translucent (a ghost) for a second replay on the same table. */
export type Look = "solid" | "ghost";

/** A renderer of table, puck and arms. */
export interface View {
  readonly canvas: HTMLCanvasElement;
  /** Size in CSS pixels; `ratio`: device pixels per CSS pixel. */
  resize(width: number, height: number, ratio: number): void;
  /** Sets the colours. */
  paint(palette: Palette): void;
  /** Draws and returns the number of draw calls. */
  draw(frame: FrameState): number;
}

/** Positions of the start and end of the drawn lines. */
export function trailRange(frame: FrameState): [number, number] {
  if (frame.layers.wholePart) return [-Infinity, Infinity];
  return [frame.position - TRAIL_S / frame.part.motion.stepS, frame.position];
}
