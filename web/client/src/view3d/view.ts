// The 3-D view: everything with three.js on a WebGL canvas.

import {
  Color,
  DirectionalLight,
  HemisphereLight,
  PCFShadowMap,
  PerspectiveCamera,
  Scene,
  WebGLRenderer,
} from "three";
import type { Contest } from "../clip/motion";
import type { Palette } from "../replay/palette";
import { trailRange, type FrameState, type View } from "../replay/frame-state";
import { ArmModel } from "./arm";
import { RenderQuality } from "./quality";
import { Orbit } from "./orbit";
import { followPointer } from "./pointer";
import { PuckModel } from "./puck";
import { Ribbon } from "./ribbon";
import { TableModel } from "./table";

const FIELD_OF_VIEW_DEG = 30;
/** Aspect ratio for which the presets are made; on a narrower picture the camera moves back. */
const REFERENCE_ASPECT = 1.6;

/** Table, puck and arms in 3-D. The constructor throws without WebGL 2. */
export class View3D implements View {
  readonly canvas: HTMLCanvasElement;
  readonly orbit: Orbit;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, REFERENCE_ASPECT, 0.05, 30);
  private readonly puck = new PuckModel();
  private readonly puckPath = new Ribbon(false);
  private readonly malletPaths = [new Ribbon(false), new Ribbon(false)];
  private readonly commandedPath = new Ribbon(true);
  private readonly arms: ArmModel[] = [];
  private table: TableModel | null = null;
  private palette: Palette | null = null;
  private distanceFactor = 1;
  private readonly quality = new RenderQuality();
  private ratio = 1;

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
    this.scene.add(new HemisphereLight(0xffffff, 0xc8ccd2, 1.9), sun());
    this.scene.add(
      this.puck.group,
      this.puckPath.mesh,
      this.commandedPath.mesh,
      ...this.malletPaths.map((ribbon) => ribbon.mesh),
    );
  }

  /** `coveredPx`: height at the bottom that controls cover; the table is drawn above it. */
  resize(width: number, height: number, ratio: number, coveredPx = 0): void {
    if (width === 0 || height === 0) return;
    this.ratio = ratio;
    this.renderer.setPixelRatio(Math.min(ratio, this.quality.ratio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, coveredPx / 2, width, height);
    const visibleShare = (height - coveredPx) / height;
    this.distanceFactor = Math.max(REFERENCE_ASPECT / this.camera.aspect, 1 / visibleShare);
  }

  paint(palette: Palette): void {
    this.palette = palette;
    if (this.scene.background instanceof Color) this.scene.background.set(palette["rp-backdrop"]);
    this.table?.paint(palette);
    for (const arm of this.arms) arm.paint(palette);
    this.puck.paint(palette);
    this.puckPath.mesh.material.color.set(palette["rp-trail"]);
    for (const ribbon of this.malletPaths) ribbon.mesh.material.color.set(palette.ink);
    this.commandedPath.mesh.material.color.set(palette["rp-commanded"]);
  }

  draw(frame: FrameState): number {
    const { motion, paths } = frame.part;
    this.addObjects(frame, motion.contest);
    for (let i = 0; i < this.arms.length; i++) this.arms[i].set(frame.arms[i]);
    this.puck.set(frame);
    const [from, to] = trailRange(frame);
    this.puckPath.set(frame.layers.puck ? paths.puck : null, from, to);
    for (let i = 0; i < this.malletPaths.length; i++) {
      this.malletPaths[i].set(
        frame.layers.mallet && i < paths.mallets.length ? paths.mallets[i] : null,
        from,
        to,
      );
    }
    this.commandedPath.set(frame.layers.commanded ? paths.commanded : null, from, to);
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

  /** Adds table and arms when the content is known. */
  private addObjects(frame: FrameState, contest: Contest): void {
    const count = frame.part.motion.arms.length;
    if (this.table !== null && this.arms.length === count) return;
    if (this.table === null) {
      this.table = new TableModel(contest);
      this.scene.add(this.table.group);
    }
    while (this.arms.length < count) {
      const arm = new ArmModel(frame.arms[this.arms.length]);
      this.arms.push(arm);
      this.scene.add(arm.group);
    }
    if (count > 1) this.orbit.widen();
    if (this.palette !== null) this.paint(this.palette);
  }

  private placeCamera(): void {
    const { x, y, z, azimuth, elevation, distance } = this.orbit;
    const flat = Math.cos(elevation) * distance * this.distanceFactor;
    this.camera.position.set(
      x + flat * Math.cos(azimuth),
      y + flat * Math.sin(azimuth),
      z + Math.sin(elevation) * distance * this.distanceFactor,
    );
    this.camera.lookAt(x, y, z);
  }
}

/** Light from above and the side, so that the shadow of a mallet shows its height. */
function sun(): DirectionalLight {
  const light = new DirectionalLight(0xffffff, 1.7);
  light.position.set(-0.8, -1.4, 3);
  light.castShadow = true;
  const { shadow } = light;
  shadow.mapSize.set(1024, 1024);
  shadow.camera.left = -2;
  shadow.camera.right = 2;
  shadow.camera.top = 1.5;
  shadow.camera.bottom = -1.5;
  shadow.camera.near = 1;
  shadow.camera.far = 6;
  shadow.normalBias = 0.01;
  shadow.radius = 3;
  return light;
}
