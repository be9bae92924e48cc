// Geometries whose pieces have colours of the palette.

import { BufferAttribute, Color, type BufferGeometry } from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { ColourName, Palette } from "../replay/palette";

/** A part of a shape with its colour. */
export type Piece = readonly [geometry: BufferGeometry, colour: ColourName];

/** Several pieces of different colours as one geometry, drawn with a single call. */
export class ColouredGeometry {
  readonly geometry: BufferGeometry;
  private readonly spans: readonly (readonly [colour: ColourName, vertices: number])[];

  constructor(pieces: readonly Piece[]) {
    const bare = pieces.map(([geometry]) => {
      const one = geometry.index === null ? geometry : geometry.toNonIndexed();
      one.deleteAttribute("uv");
      return one;
    });
    this.spans = pieces.map(([, colour], i) => [colour, bare[i].getAttribute("position").count]);
    this.geometry = mergeGeometries(bare);
    const count = this.geometry.getAttribute("position").count;
    this.geometry.setAttribute("color", new BufferAttribute(new Float32Array(3 * count), 3));
  }

  paint(palette: Palette): void {
    const attribute = this.geometry.getAttribute("color");
    const colour = new Color();
    let vertex = 0;
    for (const [name, vertices] of this.spans) {
      colour.set(palette[name]);
      for (let i = 0; i < vertices; i++, vertex++) attribute.setXYZ(vertex, colour.r, colour.g, colour.b);
    }
    attribute.needsUpdate = true;
  }
}
