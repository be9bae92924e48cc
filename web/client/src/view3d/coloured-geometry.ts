// Geometries whose pieces have colours of the palette.

import { BufferAttribute, Color, Uint16BufferAttribute, type BufferGeometry } from "three";
import { mergeGeometries, mergeVertices } from "three/addons/utils/BufferGeometryUtils.js";
import type { ColourName, Palette } from "../replay/palette";

/** A colour of the palette, or a mixture: the second colour has this share. */
export type Paint = ColourName | readonly [ColourName, ColourName | "black" | "white", number];

/** A part of a shape. */
export interface Piece {
  readonly geometry: BufferGeometry;
  readonly paint: Paint;
  /** Brightness at a position, for shade that never changes; 1 if absent. */
  readonly shade?: (x: number, y: number, z: number) => number;
  /** Index of the rigid body that the piece belongs to; 0 if absent. */
  readonly body?: number;
}

interface Span {
  readonly paint: Paint;
  readonly vertices: number;
}

/** Several pieces of different colours as one geometry, drawn with a single call. */
export class ColouredGeometry {
  readonly geometry: BufferGeometry;
  private readonly spans: readonly Span[];
  private readonly shades: Float32Array;

  constructor(pieces: readonly Piece[]) {
    const bare = pieces.map(({ geometry }) => {
      geometry.deleteAttribute("uv");
      // Vertices that faces share are computed only once per frame.
      return geometry.index === null ? mergeVertices(geometry) : geometry;
    });
    this.spans = pieces.map(({ paint }, i) => ({ paint, vertices: bare[i].getAttribute("position").count }));
    this.geometry = mergeGeometries(bare);
    for (const one of bare) one.dispose();
    const positions = this.geometry.getAttribute("position");
    this.shades = new Float32Array(positions.count).fill(1);
    this.geometry.setAttribute("color", new BufferAttribute(new Float32Array(3 * positions.count), 3));
    let vertex = 0;
    pieces.forEach(({ shade }, i) => {
      for (const end = vertex + this.spans[i].vertices; vertex < end; vertex++) {
        if (shade === undefined) continue;
        this.shades[vertex] = shade(positions.getX(vertex), positions.getY(vertex), positions.getZ(vertex));
      }
    });
    if (pieces.some(({ body }) => body !== undefined)) this.bindBodies(pieces);
  }

  paint(palette: Palette): void {
    const attribute = this.geometry.getAttribute("color");
    const colour = new Color();
    let vertex = 0;
    for (const { paint, vertices } of this.spans) {
      mix(palette, paint, colour);
      for (let i = 0; i < vertices; i++, vertex++) {
        const shade = this.shades[vertex];
        attribute.setXYZ(vertex, colour.r * shade, colour.g * shade, colour.b * shade);
      }
    }
    attribute.needsUpdate = true;
  }

  /** Attributes with which each vertex moves with exactly one bone of a skeleton. */
  private bindBodies(pieces: readonly Piece[]): void {
    const { count } = this.geometry.getAttribute("position");
    const bodies = new Uint16Array(4 * count);
    const weights = new Float32Array(4 * count);
    let vertex = 0;
    pieces.forEach(({ body = 0 }, i) => {
      for (const end = vertex + this.spans[i].vertices; vertex < end; vertex++) {
        bodies[4 * vertex] = body;
        weights[4 * vertex] = 1;
      }
    });
    this.geometry.setAttribute("skinIndex", new Uint16BufferAttribute(bodies, 4));
    this.geometry.setAttribute("skinWeight", new BufferAttribute(weights, 4));
  }
}

/** Writes a colour of the palette or a mixture to `out`. */
export function mix(palette: Palette, paint: Paint, out: Color): Color {
  if (typeof paint === "string") return out.set(palette[paint]);
  const [from, to, share] = paint;
  const second = new Color(to === "black" || to === "white" ? to : palette[to]);
  return out.set(palette[from]).lerp(second, share);
}
