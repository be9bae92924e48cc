// Curves between two samples. All functions take the value at the start (p0) and at the end (p1) of an interval of length `h`,
// slopes there (v0, v1), and the time `tau` since the start.

/** Cubic Hermite curve from p0 with slope v0 to p1 with slope v1. */
export function hermite(p0: number, v0: number, p1: number, v1: number, h: number, tau: number): number {
  const s = tau / h;
  const s2 = s * s;
  const s3 = s2 * s;
  return (
    p0 * (2 * s3 - 3 * s2 + 1) + v0 * h * (s3 - 2 * s2 + s) + p1 * (3 * s2 - 2 * s3) + v1 * h * (s3 - s2)
  );
}

/** Parabola from p0 to p1 that starts with slope v0. */
export function parabolaFromSlope(p0: number, v0: number, p1: number, h: number, tau: number): number {
  const s = tau / h;
  return p0 + v0 * tau + (p1 - p0 - v0 * h) * s * s;
}

/** Parabola from p0 to p1 that ends with slope v1. */
export function parabolaToSlope(p0: number, p1: number, v1: number, h: number, tau: number): number {
  return parabolaFromSlope(p1, -v1, p0, h, h - tau);
}
