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
  Shape,
  Vector2,
  type BufferGeometry,
} from "three";
import type { Contest } from "../clip/motion";
import { MODEL } from "../model/model";
import {
  CENTRE_CIRCLE_RADIUS_M,
  OUTER_HALF_SIZE,
  roundedRimOutline,
  successRegion,
  type Point,
} from "../model/table";
import type { Palette } from "../replay/palette";
import { ColouredGeometry, type Paint, type Piece } from "./coloured-geometry";
import { FLOOR_Z_M } from "./room";
import { arc, ball, drum, mark, sheet } from "./shapes";

/** Height for drawing only, m: high enough to be visible, low enough not to hide the puck. */
const RIM_HEIGHT_M = 0.03;
/** Radius of the rims' rounded upper edges. */
const RIM_ROUND_M = 0.007;
/** Height of the table's body below the playing surface. */
const APRON_HEIGHT_M = 0.1;
const LINE_WIDTH_M = 0.007;
const LINE_Z_M = 0.0004;
/** Length of a dash with its gap on the edge of the success region. */
const DASH_LENGTH_M = 0.04;
/** Length of a dash relative to a dash with its gap. */
const DASH_SHARE = 0.55;

/** The tray behind a goal, into which a puck falls, m. */
const TRAY = { depth: 0.075, drop: 0.07, wall: 0.014, beside: 0.05 };
const LEG = { x: 0.86, y: 0.44, topRadius: 0.05, footRadius: 0.034 };

const BODY: Paint = ["rp-rim", "black", 0.35];
const INSIDE: Paint = ["rp-rim", "black", 0.72];
const LINE: Paint = ["rp-mark", "rp-rim", 0.25];

/** Static objects: the table with legs, rims, goals and lines, and the success region. */
export class TableModel {
  readonly group = new Group();
  private readonly table: ColouredGeometry;
  private readonly regionMaterial = new MeshBasicMaterial({
    transparent: true,
    opacity: 0.1,
    depthWrite: false,
    side: DoubleSide,
  });

  constructor(contest: Contest) {
    this.table = new ColouredGeometry([
      ...topPieces(),
      ...goalPieces(),
      ...legPieces(),
      ...linePieces(),
      ...regionPieces(contest),
    ]);
    const table = new Mesh(this.table.geometry, new MeshLambertMaterial({ vertexColors: true }));
    table.receiveShadow = true;
    this.group.add(table);

    const region = successRegion(contest);
    if (region !== null) {
      const mesh = new Mesh(
        new PlaneGeometry(region.x_to_m - region.x_from_m, 2 * region.half_width_m),
        this.regionMaterial,
      );
      mesh.position.set((region.x_from_m + region.x_to_m) / 2, 0, 0.0006);
      this.group.add(mesh);
    }
    for (const object of [this.group, ...this.group.children]) {
      object.updateMatrix();
      object.matrixAutoUpdate = false;
    }
  }

  paint(palette: Palette): void {
    this.regionMaterial.color.set(palette.good);
    this.table.paint(palette);
  }
}

/** Playing surface, rims and body. */
function topPieces(): Piece[] {
  const { half_length_m, half_width_m, goal_half_width_m, outer_half_length_m } = MODEL.table;
  const surface: Piece = {
    geometry: sheet(steps(half_length_m), steps(half_width_m), 0),
    paint: "rp-table",
    // Rims take light from the surface next to them.
    shade: (x, y) =>
      1 - 0.16 * rimShade(half_length_m - Math.abs(x)) - 0.16 * rimShade(half_width_m - Math.abs(y)),
  };
  const slots = [1, -1].map((side): Piece => {
    const xs = [half_length_m, half_length_m + 0.03, half_length_m + 0.06, outer_half_length_m].map((x) => side * x);
    return {
      geometry: sheet(xs.sort((a, b) => a - b), [-goal_half_width_m - 0.02, 0, goal_half_width_m + 0.02], 0),
      paint: "rp-table",
      // Darker towards the tray.
      shade: (x) => 1 - (0.55 * (Math.abs(x) - half_length_m)) / (outer_half_length_m - half_length_m),
    };
  }); // prettier-ignore
  const rims = [1, -1].map((mirror): Piece => ({
    geometry: extruded(roundedRimOutline(), mirror, RIM_HEIGHT_M, RIM_ROUND_M).translate(0, 0, -0.002),
    paint: "rp-rim",
  }));
  const { x, y } = OUTER_HALF_SIZE;
  const corner = 0.06;
  const outline: Point[] = [];
  for (const [sx, sy, start] of [[1, 1, 0], [-1, 1, 1], [-1, -1, 2], [1, -1, 3]] as const) {
    for (let i = 0; i <= 6; i++) {
      const angle = (start + i / 6) * (Math.PI / 2);
      outline.push([sx * (x - 0.004 - corner) + corner * Math.cos(angle), sy * (y - 0.004 - corner) + corner * Math.sin(angle)]);
    }
  } // prettier-ignore
  const apron: Piece = {
    geometry: extruded(outline, 1, APRON_HEIGHT_M, 0.01).translate(0, 0, -APRON_HEIGHT_M - 0.0015),
    paint: BODY,
    shade: (_x, _y, z) => 1 + 2.5 * Math.max(z, -APRON_HEIGHT_M),
  };
  return [surface, ...slots, ...rims, apron];
}

/** From one edge to the other, with close steps at the edges, where the shade of the rims is. */
function steps(half: number): number[] {
  const outer = [half, half - 0.008, half - 0.02, half - 0.045, half - 0.08];
  return [...outer.map((at) => -at), 0, ...outer.reverse()];
}

function rimShade(distance: number): number {
  return Math.max(1 - distance / 0.08, 0) ** 2;
}

/** The trays behind the goals, edged in the colours of the sides. */
function goalPieces(): Piece[] {
  const { goal_half_width_m } = MODEL.table;
  const from = OUTER_HALF_SIZE.x;
  const half = goal_half_width_m + TRAY.beside;
  const { depth, drop, wall } = TRAY;
  const height = drop + RIM_HEIGHT_M - 0.006;
  const pieces: Piece[] = [];
  for (const side of [-1, 1]) {
    const edge: Paint = ["rp-rim", side < 0 ? "rp-joint" : "rp-other-joint", 0.75];
    const block = (x: number, y: number, w: number, d: number, paint: Paint): void => {
      const outline: Point[] = [[w / 2, d / 2], [-w / 2, d / 2], [-w / 2, -d / 2], [w / 2, -d / 2]]; // prettier-ignore
      pieces.push({
        geometry: extruded(outline, 1, height, 0.004).translate(side * x, y, -drop),
        paint,
      });
    };
    block(from + depth - wall / 2, 0, wall, 2 * half, edge);
    for (const end of [-1, 1]) block(from + depth / 2, end * (half - wall / 2), depth, wall, edge);
    const bottom = new BoxGeometry(depth, 2 * half - wall, 0.01).translate(side * (from + depth / 2), 0, -drop + 0.005);
    const back = new BoxGeometry(0.004, 2 * half - 2 * wall, drop).translate(side * (from + depth - wall - 0.002), 0, -drop / 2);
    pieces.push({ geometry: bottom, paint: INSIDE }, { geometry: back, paint: INSIDE });
  } // prettier-ignore
  return pieces;
}

function legPieces(): Piece[] {
  const pieces: Piece[] = [];
  const top = -APRON_HEIGHT_M;
  for (const [x, y] of [[1, 1], [-1, 1], [-1, -1], [1, -1]] as const) {
    const shade = (_x: number, _y: number, z: number): number => 0.55 + (0.45 * (z - FLOOR_Z_M)) / (top - FLOOR_Z_M);
    pieces.push({
      geometry: drum(LEG.footRadius, FLOOR_Z_M + 0.02, top, 0.004, LEG.topRadius, 20).translate(x * LEG.x, y * LEG.y, 0),
      paint: BODY,
      shade,
    });
    const foot = ball(0.04).scale(1, 1, 0.5).translate(x * LEG.x, y * LEG.y, FLOOR_Z_M + 0.02);
    pieces.push({ geometry: foot, paint: INSIDE });
  } // prettier-ignore
  return pieces;
}

/** A flat outline as a solid with rounded edges and its bottom at height 0; `mirror` −1 mirrors y. */
function extruded(outline: readonly Point[], mirror: number, height: number, round: number): BufferGeometry {
  const points = outline.map(([x, y]) => new Vector2(x, mirror * y));
  return new ExtrudeGeometry(new Shape(points), {
    depth: height - 2 * round,
    bevelThickness: round,
    bevelSize: round,
    bevelOffset: -round,
    bevelSegments: 3,
    curveSegments: 1,
  }).translate(0, 0, round);
}

/** Centre line, centre circle, and the goals with the space in front of them. */
function linePieces(): Piece[] {
  const { half_length_m, half_width_m, goal_half_width_m } = MODEL.table;
  const z = LINE_Z_M;
  const pieces: Piece[] = [
    { geometry: mark(0, -half_width_m, 0, half_width_m, LINE_WIDTH_M, z), paint: LINE },
    {
      geometry: arc(0, 0, CENTRE_CIRCLE_RADIUS_M, LINE_WIDTH_M, z + 0.0003, 0, 2 * Math.PI),
      paint: LINE,
    },
    { geometry: drum(0.014, z, z + 0.0003, 0.0001), paint: LINE },
  ];
  for (const side of [-1, 1]) {
    const x = side * half_length_m;
    pieces.push(
      {
        geometry: mark(x, -goal_half_width_m, x, goal_half_width_m, LINE_WIDTH_M, z),
        paint: side < 0 ? "rp-joint" : "rp-other-joint",
      },
      {
        geometry: arc(x, 0, goal_half_width_m, LINE_WIDTH_M, z + 0.0003, (side * Math.PI) / 2, Math.PI),
        paint: LINE,
      },
    );
  }
  return pieces;
}

/** The dashed edge of the success region. */
function regionPieces(contest: Contest): Piece[] {
  const region = successRegion(contest);
  if (region === null) return [];
  const { x_from_m: x0, x_to_m: x1, half_width_m: y } = region;
  const sides = [
    [x0, -y, x0, y],
    [x1, -y, x1, y],
    [x0, y, x1, y],
    [x0, -y, x1, -y],
  ];
  const pieces: Piece[] = [];
  for (const [ax, ay, bx, by] of sides) {
    const dashes = Math.max(Math.floor(Math.hypot(bx - ax, by - ay) / DASH_LENGTH_M), 1);
    for (let i = 0; i < dashes; i++) {
      const a = i / dashes;
      const b = (i + DASH_SHARE) / dashes;
      const at = [ax + (bx - ax) * a, ay + (by - ay) * a, ax + (bx - ax) * b, ay + (by - ay) * b] as const;
      pieces.push({ geometry: mark(...at, LINE_WIDTH_M / 2, LINE_Z_M + 0.0004), paint: "good" });
    }
  }
  return pieces;
}
