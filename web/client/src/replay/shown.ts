import type { Kinematics } from "../model/kinematics";
import type { Pose } from "../motion/pose";
import type { Palette } from "./palette";
import type { Part } from "./source";

/** What the reader has switched on. */
export interface Layers {
  seen: boolean;
  real: boolean;
  commanded: boolean;
  puck: boolean;
  /** Lines of the whole part instead of the last second. */
  whole: boolean;
}

/** Seconds of the lines that are drawn if not the whole is. */
export const TRAIL_S = 1;

/** What is to be drawn now. One instance is written anew for each frame. */
export interface Shown {
  part: Part;
  position: number;
  readonly pose: Pose;
  /** The arms on the table, set to the pose. */
  readonly arms: readonly [Kinematics, Kinematics];
  readonly layers: Layers;
  /** Where the agent was told the puck is; NaN if nothing is known of that. */
  seenX: number;
  seenY: number;
  /** The camera has lost the puck. */
  lost: boolean;
}

/** A way to draw the table and what is on it. */
export interface View {
  readonly canvas: HTMLCanvasElement;
  /** In CSS pixels, and device pixels per one of them. */
  resize(width: number, height: number, ratio: number): void;
  paint(palette: Palette): void;
  /** Draws, and tells how many draw calls that took. */
  draw(shown: Shown): number;
}

/** The positions between which the lines are drawn. */
export function trail(shown: Shown): [number, number] {
  if (shown.layers.whole) return [-Infinity, Infinity];
  return [shown.position - TRAIL_S / shown.part.motion.stepS, shown.position];
}
