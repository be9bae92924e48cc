// Paths in the 3-D view.

import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshBasicMaterial } from "three";
import { pointsBetween, type Path } from "../motion/paths";

/** Width of the band. */
const WIDTH_M = 0.006;
/** Length of a dash relative to a dash with its gap, which is one segment: a control step of the commanded path. */
const DASH_SHARE = 0.55;

/** A path as a flat band, because WebGL lines are always one pixel wide. */
export class Ribbon {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private path: Path | null = null;

  constructor(private readonly dashed: boolean) {
    this.mesh = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ side: DoubleSide }));
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  /** Shows the path between two positions; hides it without a path. */
  set(path: Path | null, from: number, to: number): void {
    if (path !== null && path !== this.path) {
      this.path = path;
      this.mesh.geometry.dispose();
      this.mesh.geometry = this.geometry(path);
    }
    if (path === null) {
      this.mesh.visible = false;
      return;
    }
    const [first, last] = pointsBetween(path, from, to);
    this.mesh.visible = last > first;
    this.mesh.geometry.setDrawRange(6 * first, 6 * Math.max(last - first, 0));
  }

  private geometry(path: Path): BufferGeometry {
    const segments = Math.max(path.positions.length - 1, 0);
    const corners = new Float32Array(12 * segments);
    const index = new Uint32Array(6 * segments);
    const { points: places } = path;
    for (let i = 0; i < segments; i++) {
      const share = path.gaps[i] === 1 ? 0 : this.dashed ? DASH_SHARE : 1;
      const [x, y, z] = places.subarray(3 * i, 3 * i + 3);
      const dx = places[3 * i + 3] - x;
      const dy = places[3 * i + 4] - y;
      const dz = places[3 * i + 5] - z;
      const length = Math.hypot(dx, dy) || 1;
      const half = share === 0 ? 0 : WIDTH_M / 2;
      const nx = (-dy / length) * half;
      const ny = (dx / length) * half;
      corners.set([x + nx, y + ny, z, x - nx, y - ny, z], 12 * i);
      const [ex, ey, ez] = [x + dx * share, y + dy * share, z + dz * share];
      corners.set([ex + nx, ey + ny, ez, ex - nx, ey - ny, ez], 12 * i + 6);
      const v = 4 * i;
      index.set([v, v + 1, v + 2, v + 2, v + 1, v + 3], 6 * i);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    geometry.setIndex(new BufferAttribute(index, 1));
    return geometry;
  }
}
