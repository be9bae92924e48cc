// The 3-D view: everything with three.js on a WebGL canvas.

import { Color, DirectionalLight, PCFShadowMap, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import type { Contest } from "../clip/motion";
import type { Palette } from "../replay/palette";
import { trailRange, type FrameState, type View } from "../replay/frame-state";
import { ArmModel } from "./arm";
import { ContactShadows } from "./contact-shadows";
import { fieldOf, visibleShare } from "./framing";
import { GhostModel } from "./ghost";
import { RenderQuality } from "./quality";
import { Orbit } from "./orbit";
import { followPointer } from "./pointer";
import { PuckModel } from "./puck";
import { Ribbon } from "./ribbon";
import { Floor, FLOOR_Z_M, lights } from "./room";
import { TableModel } from "./table";

const FIELD_OF_VIEW_DEG = 28;
/** Least width of a trail on the screen at its new end. */
const LEAST_TRAIL_PIXELS = 3;

/** Table, puck and arms in 3-D. The constructor throws in a browser without WebGL 2. */
export class View3D implements View {
  readonly canvas: HTMLCanvasElement;
  readonly orbit: Orbit;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  /** Share of the height that no controls cover. */
  private visibleShare = 1;
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1.6, 0.1, 60);
  private readonly floor = new Floor();
  private readonly puck = new PuckModel("solid");
  private readonly contactShadows = new ContactShadows();
  private readonly puckPath = new Ribbon(false);
  private readonly malletPaths = [new Ribbon(false), new Ribbon(false)];
  private readonly commandedPath = new Ribbon(true);
  private readonly arms: ArmModel[] = [];
  private table: TableModel | null = null;
  private ghost: GhostModel | null = null;
  private palette: Palette | null = null;
  private readonly quality = new RenderQuality();
  private ratio = 1;
  private height = 1;

  constructor(prefersReducedMotion: boolean, changed: () => void) {
    this.canvas = document.createElement("canvas");
    // Created here, because the library would log an error on browsers without WebGL 2.
    const context = this.canvas.getContext("webgl2", {
      alpha: false,
      antialias: true,
      powerPreference: "low-power",
    });
    if (context === null) throw new Error("no WebGL 2");
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    // Draw calls of shadows must be counted, too.
    this.renderer.info.autoReset = false;
    this.orbit = new Orbit(prefersReducedMotion, changed);
    followPointer(this.canvas, this.orbit);
    this.camera.up.set(0, 0, 1);
    this.scene.background = new Color();
    this.scene.add(...lights(), this.floor.mesh);
    // Flat things just above the table, from bottom to top.
    const layers = [
      this.contactShadows.mesh,
      this.puckPath.mesh,
      this.commandedPath.mesh,
      ...this.malletPaths.map((ribbon) => ribbon.mesh),
    ];
    layers.forEach((mesh, i) => {
      mesh.renderOrder = 1 + i;
    });
    this.scene.add(this.puck.group, ...layers);
  }

  /** `coveredPx`: height at the bottom that controls cover; the table is drawn above it. */
  resize(width: number, height: number, ratio: number, coveredPx = 0): void {
    if (width === 0 || height === 0) return;
    this.ratio = ratio;
    this.height = height;
    this.renderer.setPixelRatio(Math.min(ratio, this.quality.ratio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, coveredPx / 2, width, height);
    this.visibleShare = visibleShare(height, coveredPx);
    this.frameCamera();
  }

  paint(palette: Palette): void {
    this.palette = palette;
    if (this.scene.background instanceof Color) this.scene.background.set(palette["rp-backdrop"]);
    this.floor.paint(palette);
    this.table?.paint(palette);
    for (const arm of this.arms) arm.paint(palette);
    this.puck.paint(palette);
    this.ghost?.paint(palette);
    this.puckPath.paint(palette["rp-trail"]);
    this.malletPaths[0].paint(palette["rp-mallet"]);
    this.malletPaths[1].paint(palette["rp-other-mallet"]);
    this.commandedPath.paint(palette["rp-commanded"]);
  }

  draw(frame: FrameState): number {
    const { motion, paths } = frame.part;
    this.addObjects(frame, motion.contest);
    for (let i = 0; i < this.arms.length; i++) this.arms[i].set(frame.arms[i]);
    const metresPerPixel =
      (2 * this.orbit.distance * Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360)) / this.height;
    this.puck.set(frame, metresPerPixel);
    this.contactShadows.set(frame);
    const [from, to] = trailRange(frame);
    const least = LEAST_TRAIL_PIXELS * metresPerPixel;
    this.puckPath.set(frame.layers.puck ? paths.puck : null, from, to, least);
    for (let i = 0; i < this.malletPaths.length; i++) {
      const path = frame.layers.mallet && i < paths.mallets.length ? paths.mallets[i] : null;
      this.malletPaths[i].set(path, from, to, least);
    }
    this.commandedPath.set(frame.layers.commanded ? paths.commanded : null, from, to, least);
    this.drawGhost(frame.ghost, metresPerPixel, least);
    this.placeCamera();
    this.renderer.info.reset();
    this.renderer.render(this.scene, this.camera);
    return this.renderer.info.render.calls;
  }

  /** Call once per frame during playback: reduces the quality on slow machines. */
  adaptQuality(nowMs: number): void {
    if (!this.quality.recordFrame(nowMs)) return;
    this.renderer.shadowMap.enabled = this.quality.shadows;
    // Materials are compiled with shadows: only the lights are switched.
    this.scene.traverse((object) => {
      if (object instanceof DirectionalLight) object.castShadow = this.quality.shadows;
    });
    this.renderer.setPixelRatio(Math.min(this.ratio, this.quality.ratio));
  }

  private drawGhost(frame: FrameState | null, metresPerPixel: number, leastTrailM: number): void {
    if (frame !== null && this.ghost === null) {
      this.ghost = new GhostModel(frame.arms[0]);
      this.scene.add(this.ghost.group);
      if (this.palette !== null) this.ghost.paint(this.palette);
    }
    this.ghost?.set(frame, metresPerPixel, leastTrailM);
  }

  /** Adds table and arms when the content is known. */
  private addObjects(frame: FrameState, contest: Contest): void {
    const count = frame.part.motion.arms.length;
    if (this.table !== null && this.arms.length === count) return;
    if (this.table === null) {
      this.table = new TableModel(contest);
      this.scene.add(this.table.group);
    }
    while (this.arms.length < count) {
      const arm = new ArmModel(frame.arms[this.arms.length], FLOOR_Z_M, "solid");
      this.arms.push(arm);
      this.scene.add(arm.mesh);
    }
    this.frameCamera();
    if (this.palette !== null) this.paint(this.palette);
  }

  private frameCamera(): void {
    const field = fieldOf((FIELD_OF_VIEW_DEG * Math.PI) / 180, this.camera.aspect);
    const visible = { ...field, tanY: field.tanY * this.visibleShare };
    this.orbit.frame(visible, Math.max(this.arms.length, 1));
  }

  private placeCamera(): void {
    const { x, y, z, azimuth, elevation, distance } = this.orbit;
    const flat = Math.cos(elevation) * distance;
    this.camera.position.set(
      x + flat * Math.cos(azimuth),
      y + flat * Math.sin(azimuth),
      z + Math.sin(elevation) * distance,
    );
    this.camera.lookAt(x, y, z);
  }
}
