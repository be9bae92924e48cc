import { OUTER } from "../model/table";

/** Margins for the axes, CSS pixels. */
const LEFT = 46;
const BOTTOM = 40;
const RIGHT = 14;
const TOP = 14;

/** From the table frame (m, y up) to the picture (pixels, y down); the same scale along both. */
export class Projection {
  readonly scale: number;
  private readonly x0: number;
  private readonly y0: number;

  constructor(
    readonly width: number,
    readonly height: number,
  ) {
    const wide = (width - LEFT - RIGHT) / (2 * OUTER.x);
    const high = (height - TOP - BOTTOM) / (2 * OUTER.y);
    this.scale = Math.max(Math.min(wide, high), 1);
    this.x0 = LEFT + (width - LEFT - RIGHT) / 2;
    this.y0 = TOP + (height - TOP - BOTTOM) / 2;
  }

  x(x: number): number {
    return this.x0 + x * this.scale;
  }

  y(y: number): number {
    return this.y0 - y * this.scale;
  }

  length(metres: number): number {
    return metres * this.scale;
  }
}
