// Soft shadows where puck and mallets touch the table.

import { BufferAttribute, InstancedMesh, Matrix4, MeshBasicMaterial, RingGeometry } from "three";
import { MODEL } from "../model/model";
import type { FrameState } from "../replay/frame-state";

/** Radius of a shadow relative to its object. */
const SPREAD = 1.55;
const OPACITY = 0.42;
/** Height at which a mallet has lost its contact shadow, m. */
const VANISHING_HEIGHT_M = 0.08;
const SHADOW_Z_M = 0.001;
/** The puck and two mallets. */
const MAX_OBJECTS = 3;

/** The shadows of the puck and up to two mallets, drawn with a single call. They remain when cast shadows are switched off. */
export class ContactShadows {
  readonly mesh: InstancedMesh;
  private readonly matrix = new Matrix4();

  constructor() {
    const geometry = new RingGeometry(0, 1, 32, 4);
    const position = geometry.getAttribute("position");
    const colours = new Float32Array(4 * position.count);
    for (let i = 0; i < position.count; i++) {
      const outwards = Math.hypot(position.getX(i), position.getY(i));
      const share = Math.min(Math.max((1 - outwards) / (1 - 0.8 / SPREAD), 0), 1);
      colours[4 * i + 3] = OPACITY * share * share;
    }
    geometry.setAttribute("color", new BufferAttribute(colours, 4));
    this.mesh = new InstancedMesh(
      geometry,
      new MeshBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }),
      MAX_OBJECTS,
    );
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
  }

  set(frame: FrameState): void {
    const { arms } = frame.part.motion;
    const { puck, mallet } = MODEL;
    this.place(0, frame.pose.x, frame.pose.y, puck.radius_m);
    for (let i = 0; i < arms.length; i++) {
      const [x, y, z] = frame.arms[i].malletCentre;
      const height = Math.max(z - mallet.half_height_m, 0);
      this.place(1 + i, x, y, mallet.radius_m * Math.max(1 - height / VANISHING_HEIGHT_M, 0));
    }
    this.mesh.count = 1 + arms.length;
    this.mesh.instanceMatrix.needsUpdate = true;
  }

  private place(index: number, x: number, y: number, radius: number): void {
    const scale = radius * SPREAD;
    this.matrix.makeScale(scale, scale, 1).setPosition(x, y, SHADOW_Z_M);
    this.mesh.setMatrixAt(index, this.matrix);
  }
}
