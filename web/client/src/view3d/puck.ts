// The puck in the 3-D view.

import { BoxGeometry, Group, Mesh, MeshBasicMaterial, MeshStandardMaterial, TorusGeometry } from "three";
import { MODEL } from "../model/model";
import type { Palette } from "../replay/palette";
import type { FrameState } from "../replay/frame-state";
import { ColouredGeometry } from "./coloured-geometry";
import { drum, mark } from "./shapes";

const { radius_m: RADIUS, height_m: HEIGHT } = MODEL.puck;

/** The puck, and its observed position. */
export class PuckModel {
  readonly group = new Group();
  private readonly painted = new ColouredGeometry([
    [drum(RADIUS, 0, HEIGHT, 0.003), "rp-puck"],
    // The line shows the orientation.
    [new BoxGeometry(RADIUS * 0.8, 0.005, 0.001).translate(RADIUS * 0.4, 0, HEIGHT), "rp-table"],
  ]);
  private readonly puck: Mesh;
  private readonly seenColour = new MeshBasicMaterial();
  private readonly seen: Mesh;
  private readonly lost: Mesh;

  constructor() {
    this.puck = new Mesh(
      this.painted.geometry,
      new MeshStandardMaterial({ vertexColors: true, roughness: 0.5 }),
    );
    this.puck.castShadow = true;
    this.seen = new Mesh(new TorusGeometry(RADIUS, 0.0022, 8, 48), this.seenColour);
    const r = RADIUS * 0.8;
    const cross = new ColouredGeometry([
      [mark(-r, -r, r, r, 0.005, 0), "rp-seen"],
      [mark(-r, r, r, -r, 0.005, 0), "rp-seen"],
    ]);
    this.lost = new Mesh(cross.geometry, this.seenColour);
    this.group.add(this.puck, this.seen, this.lost);
  }

  set(frame: FrameState): void {
    const { pose } = frame;
    this.puck.position.set(pose.x, pose.y, 0);
    this.puck.rotation.z = pose.yaw;
    const seen = frame.layers.seen && !Number.isNaN(frame.seenX);
    this.seen.visible = seen;
    this.lost.visible = seen && frame.isPuckLost;
    if (!seen) return;
    // Above the puck, else the outline would be hidden when both positions are equal.
    this.seen.position.set(frame.seenX, frame.seenY, HEIGHT + 0.002);
    this.lost.position.copy(this.seen.position);
  }

  paint(palette: Palette): void {
    this.painted.paint(palette);
    this.seenColour.color.set(palette["rp-seen"]);
  }
}
