// Paths in the 3-D view.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  Mesh,
  ShaderMaterial,
  type ColorRepresentation,
} from "three";
import { pointsBetween, type Path } from "../motion/paths";
import { OPACITY_EXPONENT, WIDTH_EXPONENT } from "../motion/taper";

/** Width of a band at its new end. */
const WIDTH_M = 0.012;
/** A dash is a control step of the commanded path; this share of it is drawn. */
const DASH_SHARE = "0.55";
/** Cosine of the largest bend whose edges are joined. At a sharper one, a bounce, the band is interrupted instead. */
const LEAST_BEND_COSINE = 0.3;

const VERTEX_SHADER = `
attribute vec2 side;
attribute float place;
uniform float from;
uniform float to;
uniform float halfWidth;
varying float vPlace;
varying float vFresh;
void main() {
  vPlace = place;
  vFresh = clamp((place - from) / (to - from), 0.0, 1.0);
  vec3 corner = position + vec3(side * halfWidth * pow(vFresh, ${WIDTH_EXPONENT}), 0.0);
  gl_Position = projectionMatrix * viewMatrix * vec4(corner, 1.0);
}`;

const FRAGMENT_SHADER = `
uniform vec3 colour;
uniform float to;
uniform bool dashed;
varying float vPlace;
varying float vFresh;
void main() {
  if (vPlace > to || (dashed && fract(vPlace) > ${DASH_SHARE})) discard;
  gl_FragColor = vec4(colour, pow(vFresh, ${OPACITY_EXPONENT.toFixed(1)}));
  #include <colorspace_fragment>
}`;

/** A path as a flat band, because WebGL lines are always one pixel wide. It tapers towards its old end. */
export class Ribbon {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly uniforms: {
    readonly from: { value: number };
    readonly to: { value: number };
    readonly halfWidth: { value: number };
    readonly colour: { value: Color };
    readonly dashed: { value: boolean };
  };
  private path: Path | null = null;

  constructor(dashed: boolean) {
    this.uniforms = {
      from: { value: 0 },
      to: { value: 1 },
      halfWidth: { value: WIDTH_M / 2 },
      colour: { value: new Color() },
      dashed: { value: dashed },
    };
    const material = new ShaderMaterial({
      uniforms: this.uniforms,
      vertexShader: VERTEX_SHADER,
      fragmentShader: FRAGMENT_SHADER,
      side: DoubleSide,
      transparent: true,
      depthWrite: false,
    });
    this.mesh = new Mesh(new BufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.visible = false;
  }

  paint(colour: ColorRepresentation): void {
    this.uniforms.colour.value.set(colour);
  }

  /** Shows the path between two positions; hides it without a path. `leastWidth`: a narrower band could not be seen, m. */
  set(path: Path | null, from: number, to: number, leastWidth: number): void {
    if (path !== null && path !== this.path) {
      this.path = path;
      this.mesh.geometry.dispose();
      this.mesh.geometry = bandGeometry(path);
    }
    if (path === null) {
      this.mesh.visible = false;
      return;
    }
    // One segment more: the shader cuts it where the trail ends between two points.
    const [first, lastBefore] = pointsBetween(path, from, to);
    const last = Math.min(lastBefore + 1, path.positions.length - 1);
    this.mesh.visible = last > first;
    this.mesh.geometry.setDrawRange(6 * first, 6 * Math.max(last - first, 0));
    // The whole path does not taper; the numbers must be finite.
    this.uniforms.from.value = from === -Infinity ? -1e6 : from;
    this.uniforms.to.value = to === Infinity ? 1e6 : to;
    this.uniforms.halfWidth.value = Math.max(WIDTH_M, leastWidth) / 2;
  }
}

/** The band of a path: per segment four corners, each with its offset from the path at full width 2, and its position. */
export function bandGeometry(path: Path): BufferGeometry {
  const { points, positions, gaps } = path;
  const segments = Math.max(positions.length - 1, 0);
  const centres = new Float32Array(12 * segments);
  const sides = new Float32Array(8 * segments);
  const places = new Float32Array(4 * segments);
  const index = new Uint32Array(6 * segments);
  const normals = Array.from({ length: segments }, (_, i): readonly [number, number] => {
    const dx = points[3 * i + 3] - points[3 * i];
    const dy = points[3 * i + 4] - points[3 * i + 1];
    const length = Math.hypot(dx, dy);
    return length === 0 || gaps[i] === 1 ? [0, 0] : [-dy / length, dx / length];
  });
  for (let i = 0; i < segments; i++) {
    const start = joined(normals[i], i > 0 ? normals[i - 1] : normals[i]);
    const end = joined(normals[i], i + 1 < segments ? normals[i + 1] : normals[i]);
    const v = 4 * i;
    for (let corner = 0; corner < 4; corner++) {
      const point = corner < 2 ? i : i + 1;
      const [nx, ny] = corner < 2 ? start : end;
      const sign = corner % 2 === 0 ? 1 : -1;
      centres.set(points.subarray(3 * point, 3 * point + 3), 3 * (v + corner));
      sides.set([sign * nx, sign * ny], 2 * (v + corner));
      places[v + corner] = positions[point];
    }
    index.set([v, v + 1, v + 2, v + 2, v + 1, v + 3], 6 * i);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(centres, 3));
  geometry.setAttribute("side", new BufferAttribute(sides, 2));
  geometry.setAttribute("place", new BufferAttribute(places, 1));
  geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}

/** The direction to the edge of a band at a bend between two segments. */
function joined(own: readonly [number, number], other: readonly [number, number]): readonly [number, number] {
  const cosine = own[0] * other[0] + own[1] * other[1];
  if (cosine < LEAST_BEND_COSINE) return own;
  // Longer at a bend, so that the band keeps its width.
  return [(own[0] + other[0]) / (1 + cosine), (own[1] + other[1]) / (1 + cosine)];
}
