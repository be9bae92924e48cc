// The ghost in the 3-D view: another replay on the same table.

import { Group } from "three";
import type { Kinematics } from "../model/kinematics";
import { trailRange, type FrameState } from "../replay/frame-state";
import type { Palette } from "../replay/palette";
import { ArmModel } from "./arm";
import { PuckModel } from "./puck";
import { Ribbon } from "./ribbon";
import { FLOOR_Z_M } from "./room";

/** Order of drawing of the ghost's trails: above the contact shadows, below the trails of the first replay. */
const TRAIL_ORDER = 1.5;
/** That of the ghost's arm and puck: after all trails, which are seen through them. */
const BODY_ORDER = 10;

/** Arm, puck and trails of another replay: translucent, in a colour of their own. */
export class GhostModel {
  readonly group = new Group();
  private readonly arm: ArmModel;
  private readonly puck = new PuckModel("ghost");
  private readonly puckPath = new Ribbon(false);
  private readonly malletPath = new Ribbon(false);

  constructor(arm: Kinematics) {
    this.arm = new ArmModel(arm, FLOOR_Z_M, "ghost");
    for (const path of [this.puckPath, this.malletPath]) path.mesh.renderOrder = TRAIL_ORDER;
    for (const mesh of [this.arm.mesh, ...this.puck.group.children]) mesh.renderOrder = BODY_ORDER;
    this.group.add(this.puckPath.mesh, this.malletPath.mesh, this.puck.group, this.arm.mesh);
  }

  /** Shows this state; nothing without one. */
  set(frame: FrameState | null, metresPerPixel: number, leastTrailM: number): void {
    this.group.visible = frame !== null;
    if (frame === null) return;
    const { layers } = frame;
    const { paths } = frame.part;
    const [from, to] = trailRange(frame);
    this.arm.set(frame.arms[0]);
    this.puck.set(frame, metresPerPixel);
    this.puckPath.set(layers.puck ? paths.puck : null, from, to, leastTrailM);
    this.malletPath.set(layers.mallet ? paths.mallets[0] : null, from, to, leastTrailM);
  }

  paint(palette: Palette): void {
    this.arm.paint(palette);
    this.puck.paint(palette);
    this.puckPath.paint(palette["rp-ghost"]);
    this.malletPath.paint(palette["rp-ghost"]);
  }
}
