import { ClipError } from "./error";
import type { Fields } from "./checks";

/** Encoding of a column in the payload. */
export interface ColumnPlan {
  readonly name: string;
  readonly unit: string;
  readonly scale: number;
  readonly order: number;
  readonly first: number;
  readonly count: number;
  readonly bytes: number;
}

/** Values of a column by sample of the clip; NaN without a value. */
export interface Column {
  readonly name: string;
  readonly unit: string;
  readonly values: Float64Array;
}

export function parsePlan(fields: Fields, samples: number): ColumnPlan {
  const plan = {
    name: fields.text("name"),
    unit: fields.has("unit") ? fields.text("unit") : "",
    scale: fields.number("scale"),
    order: fields.whole("order", 0, 9),
    first: fields.whole("first", 0, samples),
    count: fields.whole("count", 0, samples),
    bytes: fields.whole("bytes", 0, Number.MAX_SAFE_INTEGER),
  };
  if (plan.first + plan.count > samples) {
    throw new ClipError(
      `column ${plan.name} holds samples ${plan.first} to ${plan.first + plan.count - 1} of a clip of ${samples}`,
    );
  }
  return plan;
}

/** Decodes a column: differences of the plan's order, zig-zag encoded, as unsigned LEB128. */
export function decodeColumn(plan: ColumnPlan, bytes: Uint8Array, samples: number): Column {
  if (plan.order > 2) {
    throw new ClipError(`column ${plan.name} has differences of order ${plan.order}; expected 0 to 2`);
  }
  const values = new Float64Array(samples).fill(NaN);
  let at = 0;
  let last = 0;
  let beforeLast = 0;
  for (let i = 0; i < plan.count; i++) {
    // Multiplication instead of bit operations, which would truncate numbers to 32 bits.
    let coded = 0;
    let weight = 1;
    for (;;) {
      if (at >= bytes.length) {
        throw new ClipError(`column ${plan.name} ends after ${i} of ${plan.count} numbers`);
      }
      const byte = bytes[at++];
      coded += (byte & 0x7f) * weight;
      if (byte < 0x80) break;
      weight *= 128;
      if (weight > 2 ** 49) throw new ClipError(`column ${plan.name} has a number of more than 53 bits`);
    }
    if (coded > Number.MAX_SAFE_INTEGER) {
      throw new ClipError(`column ${plan.name} has a number of more than 53 bits`);
    }
    const difference = coded % 2 === 0 ? coded / 2 : -(coded + 1) / 2;
    const value =
      plan.order === 0
        ? difference
        : plan.order === 1
          ? difference + last
          : difference + 2 * last - beforeLast;
    beforeLast = last;
    last = value;
    values[plan.first + i] = value * plan.scale;
  }
  if (at !== bytes.length) {
    throw new ClipError(`column ${plan.name} has ${bytes.length - at} bytes after its ${plan.count} numbers`);
  }
  return { name: plan.name, unit: plan.unit, values };
}
