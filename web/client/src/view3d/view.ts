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
import { trail, type Shown, type View } from "../replay/shown";
import { ArmModel } from "./arm";
import { Effort } from "./effort";
import { Orbit } from "./orbit";
import { followPointer } from "./pointer";
import { PuckModel } from "./puck";
import { Ribbon } from "./ribbon";
import { TableModel } from "./table";

const FIELD_OF_VIEW = 30;
/** The camera's places fit a picture of this shape; on a narrower one it stands farther off. */
const SHAPE = 1.6;

/** The table, the puck and the arms in space. Fails to be made where there is no WebGL. */
export class View3D implements View {
  readonly canvas: HTMLCanvasElement;
  readonly orbit: Orbit;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, SHAPE, 0.05, 30);
  private readonly puck = new PuckModel();
  private readonly puckPath = new Ribbon(false);
  private readonly real = [new Ribbon(false), new Ribbon(false)];
  private readonly commanded = new Ribbon(true);
  private readonly arms: ArmModel[] = [];
  private table: TableModel | null = null;
  private palette: Palette | null = null;
  private farther = 1;
  private readonly effort = new Effort();
  private ratio = 1;

  constructor(still: boolean, changed: () => void) {
    this.canvas = document.createElement("canvas");
    // Asked for here, as the library reports a browser without it in the console, where it alarms for nothing.
    const context = this.canvas.getContext("webgl2", {
      alpha: false,
      antialias: true,
      powerPreference: "low-power",
    });
    if (context === null) throw new Error("no WebGL 2");
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    // What is reported as draw calls is to include those of the shadows.
    this.renderer.info.autoReset = false;
    this.orbit = new Orbit(still, changed);
    followPointer(this.canvas, this.orbit);
    this.camera.up.set(0, 0, 1);
    this.scene.background = new Color();
    this.scene.add(new HemisphereLight(0xffffff, 0xc8ccd2, 1.9), sun());
    this.scene.add(
      this.puck.group,
      this.puckPath.mesh,
      this.commanded.mesh,
      ...this.real.map((ribbon) => ribbon.mesh),
    );
  }

  resize(width: number, height: number, ratio: number): void {
    if (width === 0 || height === 0) return;
    this.ratio = ratio;
    this.renderer.setPixelRatio(Math.min(ratio, this.effort.ratio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.farther = Math.max(SHAPE / this.camera.aspect, 1);
  }

  paint(palette: Palette): void {
    this.palette = palette;
    if (this.scene.background instanceof Color) this.scene.background.set(palette["rp-backdrop"]);
    this.table?.paint(palette);
    for (const arm of this.arms) arm.paint(palette);
    this.puck.paint(palette);
    this.puckPath.mesh.material.color.set(palette["rp-trail"]);
    for (const ribbon of this.real) ribbon.mesh.material.color.set(palette.ink);
    this.commanded.mesh.material.color.set(palette["rp-commanded"]);
  }

  draw(shown: Shown): number {
    const { motion, paths } = shown.part;
    this.furnish(shown, motion.contest);
    for (let i = 0; i < this.arms.length; i++) this.arms[i].set(shown.arms[i]);
    this.puck.set(shown);
    const [from, to] = trail(shown);
    this.puckPath.set(shown.layers.puck ? paths.puck : null, from, to);
    for (let i = 0; i < this.real.length; i++) {
      this.real[i].set(shown.layers.real && i < paths.real.length ? paths.real[i] : null, from, to);
    }
    this.commanded.set(shown.layers.commanded ? paths.commanded : null, from, to);
    this.seat();
    this.renderer.info.reset();
    this.renderer.render(this.scene, this.camera);
    return this.renderer.info.render.calls;
  }

  /** To be told of each frame while it plays: a machine that cannot keep up gets a plainer picture. */
  pace(nowMs: number): void {
    if (!this.effort.tooSlow(nowMs)) return;
    this.renderer.shadowMap.enabled = this.effort.shadows;
    // Materials know at their making whether there are shadows.
    this.scene.traverse((object) => {
      if (object instanceof DirectionalLight) object.castShadow = this.effort.shadows;
    });
    this.renderer.setPixelRatio(Math.min(this.ratio, this.effort.ratio));
  }

  /** Table and arms, once it is known what is played. */
  private furnish(shown: Shown, contest: Contest): void {
    const count = shown.part.motion.arms.length;
    if (this.table !== null && this.arms.length === count) return;
    if (this.table === null) {
      this.table = new TableModel(contest);
      this.scene.add(this.table.group);
    }
    while (this.arms.length < count) {
      const arm = new ArmModel(shown.arms[this.arms.length]);
      this.arms.push(arm);
      this.scene.add(arm.group);
    }
    if (count > 1) this.orbit.widen();
    if (this.palette !== null) this.paint(this.palette);
  }

  private seat(): void {
    const { x, y, z, azimuth, elevation, distance } = this.orbit;
    const flat = Math.cos(elevation) * distance * this.farther;
    this.camera.position.set(
      x + flat * Math.cos(azimuth),
      y + flat * Math.sin(azimuth),
      z + Math.sin(elevation) * distance * this.farther,
    );
    this.camera.lookAt(x, y, z);
  }
}

/** From above and aside, so that a mallet's shadow shows how high it is. */
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
