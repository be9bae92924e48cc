// Trails become narrower and paler towards their old end.

/** Width and opacity of a point are its `freshness` (1 at the new end, 0 at the old end) to the power of these. */
export const WIDTH_EXPONENT = 0.7;
export const OPACITY_EXPONENT = 0.8;

/** How recent a point of a trail is, from `from` to `to`: 1 at the new end, 0 at the old end and before it. */
export function freshness(position: number, from: number, to: number): number {
  if (from === -Infinity) return 1;
  if (to <= from) return 0;
  return Math.min(Math.max((position - from) / (to - from), 0), 1);
}
