// The table in the 3-D view.

import {
  BoxGeometry,
  DoubleSide,
  ExtrudeGeometry,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  PlaneGeometry,
  ShadowMaterial,
  Shape,
  Vector2,
} from "three";
import type { Contest } from "../clip/motion";
import { MODEL } from "../model/model";
import { OUTER_HALF_SIZE, rimOutline, successRegion } from "../model/table";
import type { Palette } from "../replay/palette";
import { ColouredGeometry, type Piece } from "./coloured-geometry";
import { mark } from "./shapes";

/** Height for drawing only, m: high enough to be visible, low enough not to hide the puck. */
const RIM_HEIGHT_M = 0.028;
const FLOOR_Z_M = MODEL.bases[0].z_m;
const LINE_WIDTH_M = 0.006;
/** Length of a dash with its gap on the edge of the success region. */
const DASH_LENGTH_M = 0.04;
/** Length of a dash relative to a dash with its gap. */
const DASH_SHARE = 0.55;

/** Static objects: table, rims, lines, success region, and the floor for shadows. */
export class TableModel {
  readonly group = new Group();
  private readonly surface = new MeshLambertMaterial();
  private readonly rims = new MeshLambertMaterial();
  private readonly lines: ColouredGeometry;
  private readonly region = new MeshBasicMaterial({
    transparent: true,
    opacity: 0.1,
    depthWrite: false,
    side: DoubleSide,
  });

  constructor(contest: Contest) {
    const slab = new Mesh(
      new BoxGeometry(2 * OUTER_HALF_SIZE.x, 2 * OUTER_HALF_SIZE.y, -FLOOR_Z_M),
      this.surface,
    );
    slab.position.z = FLOOR_Z_M / 2;
    slab.receiveShadow = true;

    const outline = rimOutline();
    const shapes = [1, -1].map((mirror) => new Shape(outline.map(([x, y]) => new Vector2(x, mirror * y))));
    const rims = new Mesh(
      new ExtrudeGeometry(shapes, { depth: RIM_HEIGHT_M, bevelEnabled: false }),
      this.rims,
    );
    rims.receiveShadow = true;

    const floor = new Mesh(new PlaneGeometry(9, 9), new ShadowMaterial({ opacity: 0.16 }));
    floor.position.z = FLOOR_Z_M;
    floor.receiveShadow = true;

    this.lines = new ColouredGeometry(linePieces(contest));
    this.group.add(
      slab,
      rims,
      floor,
      new Mesh(this.lines.geometry, new MeshBasicMaterial({ vertexColors: true })),
    );

    const place = successRegion(contest);
    if (place !== null) {
      const field = new Mesh(
        new PlaneGeometry(place.x_to_m - place.x_from_m, 2 * place.half_width_m),
        this.region,
      );
      field.position.set((place.x_from_m + place.x_to_m) / 2, 0, 0.0004);
      this.group.add(field);
    }
  }

  paint(palette: Palette): void {
    this.surface.color.set(palette["rp-table"]);
    this.rims.color.set(palette["rp-rim"]);
    this.region.color.set(palette.good);
    this.lines.paint(palette);
  }
}

function linePieces(contest: Contest): Piece[] {
  const { half_length_m, half_width_m, goal_half_width_m } = MODEL.table;
  const pieces: Piece[] = [[mark(0, -half_width_m, 0, half_width_m, LINE_WIDTH_M, 0.0005), "rp-mark"]];
  for (const x of [-half_length_m, half_length_m]) {
    pieces.push([mark(x, -goal_half_width_m, x, goal_half_width_m, LINE_WIDTH_M, 0.0005), "rp-mark"]);
  }
  const region = successRegion(contest);
  if (region === null) return pieces;
  const { x_from_m: x0, x_to_m: x1, half_width_m: y } = region;
  const sides = [
    [x0, -y, x0, y],
    [x1, -y, x1, y],
    [x0, y, x1, y],
    [x0, -y, x1, -y],
  ];
  for (const [ax, ay, bx, by] of sides) {
    const dashes = Math.max(Math.floor(Math.hypot(bx - ax, by - ay) / DASH_LENGTH_M), 1);
    for (let i = 0; i < dashes; i++) {
      const a = i / dashes;
      const b = (i + DASH_SHARE) / dashes;
      pieces.push([
        mark(
          ax + (bx - ax) * a,
          ay + (by - ay) * a,
          ax + (bx - ax) * b,
          ay + (by - ay) * b,
          LINE_WIDTH_M / 2,
          0.0006,
        ),
        "good",
      ]);
    }
  }
  return pieces;
}
