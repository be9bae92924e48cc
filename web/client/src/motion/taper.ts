// Trails become narrower and paler towards their old end.

/** Exponents that make width and opacity from the age of a point: 1 at the new end, 0 at the old end. */
export const WIDTH_EXPONENT = 0.7;
export const OPACITY_EXPONENT = 0.8;

/** Age of a point of a trail from `from` to `to`: 1 at the new end, 0 at the old end and before it. */
export function freshness(position: number, from: number, to: number): number {
  if (from === -Infinity) return 1;
  if (to <= from) return 0;
  return Math.min(Math.max((position - from) / (to - from), 0), 1);
}
