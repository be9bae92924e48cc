// The room around the table: floor and lights.

import {
  BufferAttribute,
  Color,
  DirectionalLight,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  type BufferGeometry,
} from "three";
import { MODEL } from "../model/model";
import { OUTER_HALF_SIZE } from "../model/table";
import type { Palette } from "../replay/palette";
import { mix } from "./coloured-geometry";
import { sheet } from "./shapes";

/** Height of the floor in the table frame, m. For drawing only: the simulation ends at the table. */
export const FLOOR_Z_M = -0.56;

/** The floor ends where its colour has become that of the backdrop, m. */
const FLOOR_HALF_SIZE_M = 5;
const FLOOR_CELLS = 72;
/** Share of the light that the middle of the table's shadow on the floor takes away. */
const TABLE_SHADE = 0.34;
const PEDESTAL_SHADE = 0.3;

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
  const sun = new DirectionalLight(0xffffff, 1.55);
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
  shadow.intensity = 0.7;
  const sky = new HemisphereLight(0xffffff, 0x8b95a1, 1.75);
  sky.position.set(0, 0, 1);
  return [sky, sun];
}
