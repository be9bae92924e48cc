// Outlines of the table for both views. Coordinates are in the table frame: origin in the centre, x towards the opponent, in metres.

import type { Contest } from "../clip/motion";
import { MODEL } from "./model";

export type Point = readonly [x: number, y: number];

/** Half the size of the table with its rims, m. */
export const OUTER_HALF_SIZE = {
  x: MODEL.table.outer_half_length_m,
  y: MODEL.table.half_width_m + MODEL.table.rim_width_m,
};

/** Number of chords per rounded corner, as in the collision shapes of the reference. */
const CHORDS_PER_CORNER = 7;

/**
 * Outline of the rim at positive y, from above; the other rim is its mirror image. The goal is open behind its line, and
 * its posts are rounded on both sides.
 */
export function rimOutline(): Point[] {
  const { half_length_m, half_width_m, goal_edge_from_m, goal_edge_to_m, goal_half_width_m, post_radius_m } =
    MODEL.table;
  const right: Point[] = [[OUTER_HALF_SIZE.x, OUTER_HALF_SIZE.y]];
  for (let i = 0; i <= CHORDS_PER_CORNER; i++)
    right.push(onPost(goal_edge_to_m, 0 - (i / CHORDS_PER_CORNER) * (Math.PI / 2)));
  for (let i = 0; i <= CHORDS_PER_CORNER; i++) {
    right.push(onPost(goal_edge_from_m, -Math.PI / 2 - (i / CHORDS_PER_CORNER) * (Math.PI / 2)));
  }
  right.push([half_length_m, half_width_m]);
  const left = right.map(([x, y]): Point => [-x, y]).reverse();
  return [...right, ...left];

  function onPost(x: number, angle: number): Point {
    return [
      x + post_radius_m * Math.cos(angle),
      goal_half_width_m + post_radius_m + post_radius_m * Math.sin(angle),
    ];
  }
}

/** The table has no centre circle in the model; it is drawn as wide as a goal. */
export const CENTRE_CIRCLE_RADIUS_M = MODEL.table.goal_half_width_m;

/** Radius for drawing of the table's outer corners, which nothing touches, m. */
const OUTER_CORNER_RADIUS_M = 0.06;
const CHORDS_PER_OUTER_CORNER = 6;

/** The outline of the rim at positive y with rounded outer corners. */
export function roundedRimOutline(): Point[] {
  const { x, y } = OUTER_HALF_SIZE;
  return rimOutline().flatMap((point): Point[] => {
    if (Math.abs(point[0]) !== x || point[1] !== y) return [point];
    const side = Math.sign(point[0]);
    return Array.from({ length: CHORDS_PER_OUTER_CORNER + 1 }, (_, i) => {
      // Anticlockwise on the left, which is the last point; the outline continues on the right.
      const share = side > 0 ? 1 - i / CHORDS_PER_OUTER_CORNER : i / CHORDS_PER_OUTER_CORNER;
      const angle = (share * Math.PI) / 2;
      return [
        side * (x - OUTER_CORNER_RADIUS_M + OUTER_CORNER_RADIUS_M * Math.cos(angle)),
        y - OUTER_CORNER_RADIUS_M + OUTER_CORNER_RADIUS_M * Math.sin(angle),
      ];
    });
  });
}

/** Region in which the puck must end for a success; games have none. */
export interface Region {
  readonly x_from_m: number;
  readonly x_to_m: number;
  readonly half_width_m: number;
}

export function successRegion(contest: Contest): Region | null {
  return contest === "game" ? null : MODEL.success_regions[contest];
}
