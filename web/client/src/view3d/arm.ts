// The arm in the 3-D view.

import { Group, Mesh, MeshStandardMaterial, Vector3 } from "three";
import type { Frame, Kinematics } from "../model/kinematics";
import { MODEL } from "../model/model";
import type { ColourName, Palette } from "../replay/palette";
import { ColouredGeometry, type Piece } from "./coloured-geometry";
import { ball, bar, drum } from "./shapes";

// Dimensions for drawing, m. The simulation does not use them.
const LINK_RADII_M = [0.088, 0.083, 0.078, 0.074, 0.066, 0.06, 0.047];
const JOINT_HALF_LENGTH_M = 0.07;
const FLANGE_LENGTH_M = 0.06;
const ROD_RADIUS_M = 0.0125;

interface Colours {
  readonly link: ColourName;
  readonly joint: ColourName;
  readonly mallet: ColourName;
}

const COLOURS: readonly [Colours, Colours] = [
  { link: "rp-arm", joint: "rp-joint", mallet: "rp-mallet" },
  { link: "rp-other", joint: "rp-other-joint", mallet: "rp-other-mallet" },
];

/** An arm: a body per link, the mallet and the base. */
export class ArmModel {
  readonly group = new Group();
  private readonly painted: ColouredGeometry[] = [];
  private readonly links: Mesh[];
  private readonly mallet: Mesh;
  private readonly material = new MeshStandardMaterial({
    vertexColors: true,
    roughness: 0.55,
    metalness: 0.05,
  });

  constructor(arm: Kinematics) {
    const colours = COLOURS[arm.side];
    this.links = LINK_RADII_M.map((_, i) => this.mesh(linkPieces(i, colours)));
    this.mallet = this.mesh(malletPieces(colours));
    const base = this.mesh([
      [bar(new Vector3(0, 0, 0), new Vector3(0, 0, 0.03), 0.13, 0.13, 40), colours.joint],
      [
        bar(new Vector3(0, 0, 0.03), new Vector3(0, 0, MODEL.links[0].position_m[2]), 0.1, 0.09, 40),
        colours.link,
      ],
    ]);
    base.castShadow = false;
    place(base, arm.base);
  }

  set(arm: Kinematics): void {
    for (let i = 0; i < this.links.length; i++) place(this.links[i], arm.links[i]);
    place(this.mallet, arm.mallet);
  }

  paint(palette: Palette): void {
    for (const painted of this.painted) painted.paint(palette);
  }

  private mesh(pieces: Piece[]): Mesh {
    const painted = new ColouredGeometry(pieces);
    this.painted.push(painted);
    const mesh = new Mesh(painted.geometry, this.material);
    mesh.castShadow = true;
    mesh.matrixAutoUpdate = false;
    this.group.add(mesh);
    return mesh;
  }
}

function linkPieces(i: number, colours: Colours): Piece[] {
  const radius = LINK_RADII_M[i];
  const origin = new Vector3();
  if (i === LINK_RADII_M.length - 1) {
    const flange = new Vector3(0, 0, FLANGE_LENGTH_M);
    const tip = new Vector3(0, 0, MODEL.end_effector_z_m);
    return [
      [bar(origin, flange, radius, radius), colours.joint],
      [bar(flange, tip, ROD_RADIUS_M, ROD_RADIUS_M, 16), colours.link],
      [ball(0.018).translate(0, 0, MODEL.end_effector_z_m), colours.joint],
    ];
  }
  const next = new Vector3(...MODEL.links[i + 1].position_m);
  const body: Piece = [bar(origin, next, radius, LINK_RADII_M[i + 1]), colours.link];
  // Odd joints turn about the axis of the arm (drawn as a collar), even joints across it (a drum).
  if (i % 2 === 0) return [body, [drum(radius + 0.003, -0.012, 0.012, 0.004), colours.joint]];
  const half = JOINT_HALF_LENGTH_M * (radius / LINK_RADII_M[1]);
  return [
    body,
    [ball(radius), colours.link],
    [drum(radius * 0.72, -half - 0.02, half + 0.02, 0.008), colours.joint],
  ];
}

function malletPieces(colours: Colours): Piece[] {
  const { radius_m, half_height_m, centre_z_m } = MODEL.mallet;
  const from = centre_z_m - half_height_m;
  return [
    [drum(radius_m, from, centre_z_m + half_height_m, 0.005), colours.mallet],
    [bar(new Vector3(0, 0, 0), new Vector3(0, 0, from), 0.016, 0.022, 20), colours.joint],
  ];
}

function place(mesh: Mesh, frame: Frame): void {
  mesh.matrix.set(
    frame[0], frame[1], frame[2], frame[9],
    frame[3], frame[4], frame[5], frame[10],
    frame[6], frame[7], frame[8], frame[11],
    0, 0, 0, 1,
  ); // prettier-ignore
  mesh.matrixWorldNeedsUpdate = true;
}
