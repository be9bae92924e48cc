// The shapes of an arm. Joint positions are the model's; the housings around them are drawn after the proportions of a
// KUKA LBR iiwa 14. The simulation does not use them.

import { MODEL } from "../model/model";
import type { Look } from "../replay/frame-state";
import type { Paint, Piece } from "./coloured-geometry";
import { ball, drum, latheShape, limb } from "./shapes";

/** Indices of the rigid bodies of an arm: base, links 1 to 7, mallet. */
export const BASE_BODY = 0;
export const MALLET_BODY = 8;
export const BODY_COUNT = 9;

/** Colours of an arm's parts. */
export interface ArmPaint {
  readonly link: Paint;
  readonly joint: Paint;
  readonly mallet: Paint;
}

const PAINT: readonly [ArmPaint, ArmPaint] = [
  { link: "rp-arm", joint: "rp-joint", mallet: "rp-mallet" },
  { link: "rp-other", joint: "rp-other-joint", mallet: "rp-other-mallet" },
];

const GHOST_PAINT: ArmPaint = { link: ["rp-ghost", "white", 0.4], joint: "rp-ghost", mallet: "rp-ghost" };

/** Dark parts: the foot, the column below it, and gaps between housings. */
const DARK: Paint = ["rp-rim", "black", 0.45];
const METAL: Paint = ["rp-rim", "white", 0.45];

/** Outer radii of the housings at the joints, m. */
const RADII_M = [0.102, 0.098, 0.084, 0.086, 0.07, 0.067, 0.046];
/** Narrowest radius of the housing between a joint and the next, m. */
const WAISTS_M = [0.092, 0.08, 0.077, 0.069, 0.059, 0.06];
const FLANGE_LENGTH_M = 0.05;
const ROD_RADIUS_M = 0.0125;

/** All pieces of an arm; `floorZ`: height of the floor in the table frame, m. */
export function armPieces(side: 0 | 1, floorZ: number, look: Look): Piece[] {
  const paint = look === "ghost" ? GHOST_PAINT : PAINT[side];
  // A ghost has its base in common with the arm of the table.
  const pieces = look === "ghost" ? [] : basePieces(paint, floorZ - MODEL.bases[side].z_m);
  for (let i = 0; i < 6; i++) pieces.push(...(i % 2 === 0 ? upright(i, paint) : across(i, paint)));
  return [...pieces, ...toolPieces(paint), ...malletPieces(paint)];
}

function basePieces(paint: ArmPaint, floor: number): Piece[] {
  const top = MODEL.links[0].position_m[2];
  const body = BASE_BODY;
  return [
    { geometry: drum(0.19, floor, floor + 0.025, 0.008), paint: DARK, body },
    {
      geometry: drum(0.125, floor + 0.025, -0.012, 0.006, 0.115),
      paint: DARK,
      body,
      // Darker towards the floor, which the light does not reach.
      shade: (_x, _y, z) => 0.75 + (0.25 * (z - floor)) / -floor,
    },
    { geometry: drum(0.15, -0.012, 0.016, 0.006), paint: ["rp-rim", "black", 0.2], body },
    {
      geometry: latheShape([
        [0.136, 0.016],
        [0.134, 0.024],
        [0.126, 0.036],
        [0.114, 0.06],
        [0.106, 0.09],
        [0.103, top - 0.006],
        [0.1, top - 0.001],
        [0.09, top],
      ]),
      paint: paint.link,
      body,
    },
  ];
}

/** A link that turns about the axis of the arm, up to the next joint, which turns across it. */
function upright(i: number, paint: ArmPaint): Piece[] {
  const body = i + 1;
  const length = MODEL.links[i + 1].position_m[2];
  const radius = RADII_M[i];
  return [
    { geometry: drum(radius - 0.004, -0.004, 0.008, 0.001), paint: DARK, body },
    { geometry: limb(length - 0.006, radius, WAISTS_M[i], RADII_M[i + 1]).translate(0, 0, 0.006), paint: paint.link, body },
    { geometry: drum(radius + 0.0015, 0.02, 0.034, 0.003), paint: paint.joint, body },
  ]; // prettier-ignore
}

/** A link that turns across the arm: a barrel about the axis of its joint, and the housing up to the next joint. */
function across(i: number, paint: ArmPaint): Piece[] {
  const body = i + 1;
  const radius = RADII_M[i];
  const next = RADII_M[i + 1];
  const length = MODEL.links[i + 1].position_m[1];
  const half = radius * 1.0;
  const pieces: Piece[] = [
    { geometry: drum(radius * 0.84, -half, half, radius * 0.36), paint: paint.link, body },
    { geometry: drum(radius * 0.58, -half - 0.007, half + 0.007, 0.005), paint: paint.joint, body },
    { geometry: drum(radius * 0.27, -half - 0.009, half + 0.009, 0.002), paint: DARK, body },
  ];
  if (i === 5) {
    // The hand is short: its housing is a ball around the joint and a neck to the flange.
    const neck = drum(next + 0.012, 0, length, 0.006, next).rotateX(-Math.PI / 2);
    return [...pieces, { geometry: ball(radius * 0.99), paint: paint.link, body }, { geometry: neck, paint: paint.link, body }];
  } // prettier-ignore
  // The limb starts at the next joint and ends around this one.
  const housing = limb(length, next, WAISTS_M[i], radius * 0.985)
    .rotateX(Math.PI / 2)
    .translate(0, length, 0);
  return [...pieces, { geometry: housing, paint: paint.link, body }];
}

/** Link 7: the flange, and the rod with the universal joint. */
function toolPieces(paint: ArmPaint): Piece[] {
  const body = 7;
  const tip = MODEL.end_effector_z_m;
  const flange = RADII_M[6];
  return [
    { geometry: drum(flange, 0.002, 0.022, 0.004), paint: paint.joint, body },
    { geometry: drum(flange * 0.86, 0.022, 0.036, 0.003), paint: METAL, body },
    { geometry: drum(0.032, 0.036, FLANGE_LENGTH_M + 0.02, 0.004, ROD_RADIUS_M + 0.004, 20), paint: DARK, body },
    { geometry: drum(ROD_RADIUS_M, FLANGE_LENGTH_M, tip, 0.002, ROD_RADIUS_M, 16), paint: METAL, body },
    { geometry: ball(0.018).translate(0, 0, tip), paint: DARK, body },
  ]; // prettier-ignore
}

/** The mallet: its widest part is the cylinder of the model up to half its height, above it a grip. z points down. */
function malletPieces(paint: ArmPaint): Piece[] {
  const { radius_m: radius, half_height_m: half, centre_z_m: centre } = MODEL.mallet;
  const body = MALLET_BODY;
  const top = centre - half;
  return [
    {
      geometry: latheShape(
        [
          [0.012, 0],
          [0.019, 0.004],
          [0.021, top],
          [0.024, top + 0.008],
          [0.033, centre - 0.009],
          [radius - 0.006, centre - 0.004],
          [radius - 0.0015, centre - 0.001],
          [radius, centre + 0.004],
          [radius, centre + half - 0.005],
          [radius - 0.0015, centre + half - 0.0015],
          [radius - 0.005, centre + half],
          [0, centre + half],
        ],
        40,
      ),
      paint: paint.mallet,
      body,
    },
  ];
}
