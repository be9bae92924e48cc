// Columns of a clip: the encoding in the payload, and the decoded values.

import { ClipError } from "./error";
import type { Fields } from "./checks";

/** Encoding of a column in the payload. */
export interface ColumnEncoding {
  readonly name: string;
  readonly unit: string;
  /** Value of one unit of the encoded whole numbers. */
  readonly scale: number;
  /** Order of differences: 0 values, 1 differences of neighbours, 2 differences of those. */
  readonly order: number;
  /** Index of the first sample with a value. */
  readonly first: number;
  /** Number of values. */
  readonly count: number;
  /** Length in the payload. */
  readonly bytes: number;
}

/** Values of a column by sample of the clip; NaN without a value. */
export interface Column {
  readonly name: string;
  readonly unit: string;
  readonly values: Float64Array;
}

export function parseEncoding(fields: Fields, samples: number): ColumnEncoding {
  const encoding = {
    name: fields.text("name"),
    unit: fields.has("unit") ? fields.text("unit") : "",
    scale: fields.number("scale"),
    // Not only up to 2, which `decodeColumn` knows: columns that the page does not need are skipped without decoding.
    order: fields.integer("order", 0, 9),
    first: fields.integer("first", 0, samples),
    count: fields.integer("count", 0, samples),
    bytes: fields.integer("bytes", 0, Number.MAX_SAFE_INTEGER),
  };
  if (encoding.first + encoding.count > samples) {
    throw new ClipError(
      `column ${encoding.name} holds samples ${encoding.first} to ${encoding.first + encoding.count - 1} of a clip of ${samples}`,
    );
  }
  return encoding;
}

/** Decodes a column: differences of the given order, zig-zag encoded, as unsigned LEB128. */
export function decodeColumn(encoding: ColumnEncoding, bytes: Uint8Array, samples: number): Column {
  if (encoding.order > 2) {
    throw new ClipError(
      `column ${encoding.name} has differences of order ${encoding.order}; expected 0 to 2`,
    );
  }
  const values = new Float64Array(samples).fill(NaN);
  let offset = 0;
  let last = 0;
  let beforeLast = 0;
  for (let i = 0; i < encoding.count; i++) {
    // Multiplication instead of bit operations, which would truncate numbers to 32 bits.
    let zigZag = 0;
    let weight = 1;
    for (;;) {
      if (offset >= bytes.length) {
        throw new ClipError(`column ${encoding.name} ends after ${i} of ${encoding.count} numbers`);
      }
      const byte = bytes[offset++];
      zigZag += (byte & 0x7f) * weight;
      if (byte < 0x80) break;
      weight *= 128;
      if (weight > 2 ** 49) throw new ClipError(`column ${encoding.name} has a number of more than 53 bits`);
    }
    if (zigZag > Number.MAX_SAFE_INTEGER) {
      throw new ClipError(`column ${encoding.name} has a number of more than 53 bits`);
    }
    const difference = zigZag % 2 === 0 ? zigZag / 2 : -(zigZag + 1) / 2;
    const value =
      encoding.order === 0
        ? difference
        : encoding.order === 1
          ? difference + last
          : difference + 2 * last - beforeLast;
    beforeLast = last;
    last = value;
    values[encoding.first + i] = value * encoding.scale;
  }
  if (offset !== bytes.length) {
    throw new ClipError(
      `column ${encoding.name} has ${bytes.length - offset} bytes after its ${encoding.count} numbers`,
    );
  }
  return { name: encoding.name, unit: encoding.unit, values };
}
