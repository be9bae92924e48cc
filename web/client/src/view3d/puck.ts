import { BoxGeometry, Group, Mesh, MeshBasicMaterial, MeshStandardMaterial, TorusGeometry } from "three";
import { MODEL } from "../model/model";
import type { Palette } from "../replay/palette";
import type { Shown } from "../replay/shown";
import { Painted } from "./painted";
import { drum, mark } from "./shapes";

const { radius_m: RADIUS, height_m: HEIGHT } = MODEL.puck;

/** The puck as it was, and where the agent was told that it is. */
export class PuckModel {
  readonly group = new Group();
  private readonly painted = new Painted([
    [drum(RADIUS, 0, HEIGHT, 0.003), "rp-puck"],
    // Which way it is turned.
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
    const cross = new Painted([
      [mark(-r, -r, r, r, 0.005, 0), "rp-seen"],
      [mark(-r, r, r, -r, 0.005, 0), "rp-seen"],
    ]);
    this.lost = new Mesh(cross.geometry, this.seenColour);
    this.group.add(this.puck, this.seen, this.lost);
  }

  set(shown: Shown): void {
    const { pose } = shown;
    this.puck.position.set(pose.x, pose.y, 0);
    this.puck.rotation.z = pose.yaw;
    const seen = shown.layers.seen && !Number.isNaN(shown.seenX);
    this.seen.visible = seen;
    this.lost.visible = seen && shown.lost;
    if (!seen) return;
    // Above the puck: an outline inside of it would not be seen when both are at the same place.
    this.seen.position.set(shown.seenX, shown.seenY, HEIGHT + 0.002);
    this.lost.position.copy(this.seen.position);
  }

  paint(palette: Palette): void {
    this.painted.paint(palette);
    this.seenColour.color.set(palette["rp-seen"]);
  }
}
