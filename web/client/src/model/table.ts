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

/** Region in which the puck must end for a success; games have none. */
export interface Region {
  readonly x_from_m: number;
  readonly x_to_m: number;
  readonly half_width_m: number;
}

export function successRegion(contest: Contest): Region | null {
  return contest === "game" ? null : MODEL.success_regions[contest];
}
