// Coordinates of the flat view.

import { OUTER_HALF_SIZE } from "../model/table";

/** Margins for the axes, CSS pixels. */
const LEFT_MARGIN = 46;
const BOTTOM_MARGIN = 40;
const RIGHT_MARGIN = 14;
const TOP_MARGIN = 14;

/** From the table frame (m, y up) to the picture (pixels, y down); the same scale along both. */
export class Projection {
  readonly scale: number;
  private readonly originX: number;
  private readonly originY: number;

  constructor(
    readonly width: number,
    readonly height: number,
  ) {
    const wide = (width - LEFT_MARGIN - RIGHT_MARGIN) / (2 * OUTER_HALF_SIZE.x);
    const high = (height - TOP_MARGIN - BOTTOM_MARGIN) / (2 * OUTER_HALF_SIZE.y);
    this.scale = Math.max(Math.min(wide, high), 1);
    this.originX = LEFT_MARGIN + (width - LEFT_MARGIN - RIGHT_MARGIN) / 2;
    this.originY = TOP_MARGIN + (height - TOP_MARGIN - BOTTOM_MARGIN) / 2;
  }

  x(x: number): number {
    return this.originX + x * this.scale;
  }

  y(y: number): number {
    return this.originY - y * this.scale;
  }

  length(metres: number): number {
    return metres * this.scale;
  }
}
