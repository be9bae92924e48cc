// The puck in the 3-D view.

import {
  BufferAttribute,
  Group,
  Mesh,
  MeshBasicMaterial,
  RingGeometry,
  TorusGeometry,
  type BufferGeometry,
} from "three";
import { MODEL } from "../model/model";
import type { ColourName, Palette } from "../replay/palette";
import type { FrameState, Look } from "../replay/frame-state";
import { ColouredGeometry } from "./coloured-geometry";
import { glossyMaterial } from "./glossy";
import { arc, drum, mark } from "./shapes";

const { radius_m: RADIUS, height_m: HEIGHT } = MODEL.puck;
/** Outer radius of the halo relative to the puck. */
const HALO_SIZE = 2.4;
const HALO_OPACITY = 0.5;
/** The halo has at least this radius on the screen. */
const LEAST_HALO_PIXELS = 15;
/** Below the trails, above the lines on the table. */
const HALO_Z_M = 0.0014;

/** The puck with a halo that makes it visible in small pictures; of a solid one also the observed position. */
export class PuckModel {
  readonly group = new Group();
  private readonly painted: ColouredGeometry;
  private readonly colour: ColourName;
  private readonly puck: Mesh;
  private readonly halo: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly seenColour = new MeshBasicMaterial();
  private readonly seen: Mesh;
  private readonly lost: Mesh;

  constructor(private readonly look: Look) {
    this.colour = look === "ghost" ? "rp-ghost" : "rp-puck";
    this.painted = new ColouredGeometry([
      { geometry: drum(RADIUS, 0.0005, HEIGHT, 0.004), paint: this.colour },
      { geometry: arc(0, 0, RADIUS * 0.74, RADIUS * 0.12, HEIGHT + 0.0004, 0, 2 * Math.PI), paint: [this.colour, "white", 0.85] },
      // The line shows the orientation.
      { geometry: mark(0, 0, RADIUS * 0.68, 0, RADIUS * 0.12, HEIGHT), paint: [this.colour, "white", 0.85] },
    ]); // prettier-ignore
    this.puck = new Mesh(this.painted.geometry, glossyMaterial(0.4, look));
    this.puck.castShadow = look === "solid";
    this.halo = new Mesh(
      haloGeometry(),
      new MeshBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }),
    );
    this.seen = new Mesh(new TorusGeometry(RADIUS, 0.0025, 8, 40), this.seenColour);
    const r = RADIUS * 0.8;
    const cross = new ColouredGeometry([
      { geometry: mark(-r, -r, r, r, 0.005, 0), paint: "rp-seen" },
      { geometry: mark(-r, r, r, -r, 0.005, 0), paint: "rp-seen" },
    ]);
    this.lost = new Mesh(cross.geometry, this.seenColour);
    this.group.add(this.halo, this.puck, this.seen, this.lost);
  }

  /** `metresPerPixel`: size of a pixel of the picture at the table. */
  set(frame: FrameState, metresPerPixel: number): void {
    const { pose } = frame;
    this.puck.position.set(pose.x, pose.y, 0);
    this.puck.rotation.z = pose.yaw;
    this.halo.position.set(pose.x, pose.y, HALO_Z_M);
    this.halo.scale.setScalar(haloScale(metresPerPixel));
    const seen = this.look === "solid" && frame.layers.seen && !Number.isNaN(frame.seenX);
    this.seen.visible = seen;
    this.lost.visible = seen && frame.isPuckLost;
    if (!seen) return;
    // Above the puck, else the outline would be hidden when both positions are equal.
    this.seen.position.set(frame.seenX, frame.seenY, HEIGHT + 0.002);
    this.lost.position.copy(this.seen.position);
  }

  paint(palette: Palette): void {
    this.painted.paint(palette);
    this.halo.material.color.set(palette[this.colour]);
    this.seenColour.color.set(palette["rp-seen"]);
  }
}

/** Scale of the halo at which it can be seen. */
export function haloScale(metresPerPixel: number): number {
  return Math.max(1, (LEAST_HALO_PIXELS * metresPerPixel) / (HALO_SIZE * RADIUS));
}

/** A disc that becomes transparent outwards. */
function haloGeometry(): BufferGeometry {
  const geometry = new RingGeometry(0, HALO_SIZE * RADIUS, 40, 6);
  const position = geometry.getAttribute("position");
  const colours = new Float32Array(4 * position.count).fill(1);
  for (let i = 0; i < position.count; i++) {
    const outwards = Math.hypot(position.getX(i), position.getY(i)) / (HALO_SIZE * RADIUS);
    colours[4 * i + 3] = HALO_OPACITY * (1 - outwards) ** 1.5;
  }
  geometry.setAttribute("color", new BufferAttribute(colours, 4));
  return geometry;
}
