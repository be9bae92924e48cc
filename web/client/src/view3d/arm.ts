// The arm in the 3-D view.

import { Bone, Skeleton, SkinnedMesh } from "three";
import type { Frame, Kinematics } from "../model/kinematics";
import type { Look } from "../replay/frame-state";
import type { Palette } from "../replay/palette";
import { armPieces, BASE_BODY, BODY_COUNT, MALLET_BODY } from "./arm-shapes";
import { ColouredGeometry } from "./coloured-geometry";
import { glossyMaterial } from "./glossy";

/** An arm: base, links and mallet as one mesh, whose rigid bodies are the bones of a skeleton. */
export class ArmModel {
  readonly mesh: SkinnedMesh;
  private readonly painted: ColouredGeometry;
  private readonly bodies = Array.from({ length: BODY_COUNT }, () => new Bone());

  constructor(arm: Kinematics, floorZ: number, look: Look) {
    this.painted = new ColouredGeometry(armPieces(arm.side, floorZ, look));
    this.mesh = new SkinnedMesh(this.painted.geometry, glossyMaterial(0.45, look));
    this.mesh.castShadow = look === "solid";
    // Its extent would have to be computed from the bones in each frame.
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    // The shapes are in the frames of their bodies: the inverse matrices are identities.
    this.mesh.bind(
      new Skeleton(
        this.bodies,
        this.bodies.map((body) => body.matrixWorld.clone()),
      ),
      this.mesh.matrixWorld,
    );
    place(this.bodies[BASE_BODY], arm.base);
  }

  set(arm: Kinematics): void {
    for (let i = 0; i < arm.links.length; i++) place(this.bodies[i + 1], arm.links[i]);
    place(this.bodies[MALLET_BODY], arm.mallet);
  }

  paint(palette: Palette): void {
    this.painted.paint(palette);
  }
}

/** The bones are in no scene: nothing else writes their world matrices. */
function place(body: Bone, frame: Frame): void {
  body.matrixWorld.set(
    frame[0], frame[1], frame[2], frame[9],
    frame[3], frame[4], frame[5], frame[10],
    frame[6], frame[7], frame[8], frame[11],
    0, 0, 0, 1,
  ); // prettier-ignore
}
