// The room around the table: floor, lights and what shiny parts reflect.

import {
  BackSide,
  BoxGeometry,
  BufferAttribute,
  Color,
  DirectionalLight,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  PMREMGenerator,
  Scene,
  type BufferGeometry,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import { MODEL } from "../model/model";
import { OUTER_HALF_SIZE } from "../model/table";
import type { Palette } from "../replay/palette";
import { mix } from "./coloured-geometry";
import { sheet } from "./shapes";

/** Height of the floor in the table frame, m. For drawing only: the simulation ends at the table. */
export const FLOOR_Z_M = -0.62;

/** The floor ends where its colour has become that of the backdrop, m. */
const FLOOR_HALF_SIZE_M = 5;
const FLOOR_CELLS = 72;
/** Share of the light that the middle of the table's shadow on the floor takes away. */
const TABLE_SHADE = 0.34;
const PEDESTAL_SHADE = 0.3;
/** Edge length of the reflected surroundings in pixels. Rough surfaces show no more of them. */
const SURROUNDINGS_PIXELS = 64;

/** The floor with soft shadows of table and pedestals, which never change: they are colours of its vertices. */
export class Floor {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;

  constructor() {
    // Closer together near the table, where the shadows are.
    const at = Array.from({ length: FLOOR_CELLS + 1 }, (_, i) => {
      const share = (2 * i) / FLOOR_CELLS - 1;
      return FLOOR_HALF_SIZE_M * (0.35 * share + 0.65 * share ** 3);
    });
    this.mesh = new Mesh(sheet(at, at, FLOOR_Z_M), new MeshBasicMaterial({ vertexColors: true }));
    const { count } = this.mesh.geometry.getAttribute("position");
    this.mesh.geometry.setAttribute("color", new BufferAttribute(new Float32Array(3 * count), 3));
    this.mesh.matrixAutoUpdate = false;
  }

  paint(palette: Palette): void {
    const position = this.mesh.geometry.getAttribute("position");
    const attribute = this.mesh.geometry.getAttribute("color");
    const backdrop = mix(palette, "rp-backdrop", new Color());
    const lit = mix(palette, ["rp-backdrop", "rp-rim", 0.14], new Color());
    const colour = new Color();
    for (let i = 0; i < position.count; i++) {
      const [x, y] = [position.getX(i), position.getY(i)];
      const near = 1 - smooth(1.2, 0.92 * FLOOR_HALF_SIZE_M, Math.hypot(x * 0.8, y));
      colour.copy(backdrop).lerp(lit, near).multiplyScalar(floorShade(x, y));
      attribute.setXYZ(i, colour.r, colour.g, colour.b);
    }
    attribute.needsUpdate = true;
  }
}

/** Brightness of the floor at a position: 1 far from table and pedestals. */
function floorShade(x: number, y: number): number {
  const outside = Math.hypot(
    Math.max(Math.abs(x) - OUTER_HALF_SIZE.x + 0.2, 0),
    Math.max(Math.abs(y) - OUTER_HALF_SIZE.y + 0.2, 0),
  );
  let light = 1 - TABLE_SHADE * (1 - smooth(0, 0.75, outside));
  for (const base of MODEL.bases) {
    const distance = Math.hypot(x - base.x_m, y - base.y_m);
    light *= 1 - PEDESTAL_SHADE * (1 - smooth(0.12, 0.55, distance));
  }
  return light;
}

function smooth(from: number, to: number, value: number): number {
  const share = Math.min(Math.max((value - from) / (to - from), 0), 1);
  return share * share * (3 - 2 * share);
}

/** Light of the sky, and light from above and the side, so that the shadow of a mallet shows its height. */
export function lights(): [HemisphereLight, DirectionalLight] {
  const sun = new DirectionalLight(0xffffff, 1.9);
  sun.position.set(-0.7, -1.2, 3);
  sun.castShadow = true;
  // Shadows fall on the table only; the map is no larger than that.
  const { shadow } = sun;
  shadow.mapSize.set(1024, 1024);
  shadow.camera.left = -1.3;
  shadow.camera.right = 1.3;
  shadow.camera.top = 1.1;
  shadow.camera.bottom = -1.1;
  shadow.camera.near = 1.2;
  shadow.camera.far = 5;
  shadow.normalBias = 0.01;
  shadow.radius = 4;
  shadow.intensity = 0.55;
  return [new HemisphereLight(0xffffff, 0xb9c0c9, 1.5), sun];
}

/** What shiny parts reflect: a bright ceiling with lamps over a dim floor. */
export function surroundings(renderer: WebGLRenderer): WebGLRenderTarget {
  const scene = new Scene();
  const box = new BoxGeometry();
  const add = (
    brightness: number,
    size: readonly number[],
    place: readonly number[],
    inside = false,
  ): void => {
    const material = new MeshBasicMaterial(inside ? { side: BackSide } : {});
    material.color.setScalar(brightness);
    const mesh = new Mesh(box, material);
    mesh.scale.set(size[0], size[1], size[2]);
    mesh.position.set(place[0], place[1], place[2]);
    scene.add(mesh);
  };
  add(0.35, [20, 20, 10], [0, 0, 2], true);
  add(0.6, [20, 20, 0.1], [0, 0, 6.9]);
  add(0.12, [20, 20, 0.1], [0, 0, -2.9]);
  add(5, [5, 2, 0.1], [-2, -4, 6]);
  add(3, [2, 6, 0.1], [5, 2, 6]);
  add(2.5, [0.1, 7, 2], [-9, 0, 3]);
  add(1.6, [8, 0.1, 1.6], [0, 9, 2.5]);
  const generator = new PMREMGenerator(renderer);
  const target = generator.fromScene(scene, 0.03, 0.1, 50, { size: SURROUNDINGS_PIXELS });
  generator.dispose();
  for (const object of scene.children)
    if (object instanceof Mesh) (object.material as MeshBasicMaterial).dispose();
  box.dispose();
  return target;
}
