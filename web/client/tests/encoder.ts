/** Encodes clips for the tests in the format of the server. */

export interface TestColumn {
  name: string;
  values: number[];
  unit?: string;
  scale?: number;
  order?: number;
  first?: number;
}

/** Zig-zag and LEB128 encoding of whole numbers. */
export function varints(numbers: number[]): number[] {
  const bytes: number[] = [];
  for (const n of numbers) {
    let rest = n >= 0 ? 2 * n : -2 * n - 1;
    while (rest >= 128) {
      bytes.push((rest % 128) | 0x80);
      rest = Math.floor(rest / 128);
    }
    bytes.push(rest);
  }
  return bytes;
}

/** Differences of the given order. */
function differences(numbers: number[], order: number): number[] {
  let out = numbers;
  for (let i = 0; i < order; i++) out = out.map((n, k) => (k === 0 ? n : n - out[k - 1]));
  return out;
}

/** A clip with these columns; `header` replaces or adds header fields. */
export function encode(header: Record<string, unknown>, columns: TestColumn[]): Uint8Array<ArrayBuffer> {
  const parts = columns.map((column) => {
    const { scale = 1e-4, order = 1 } = column;
    const whole = column.values.map((value) => Math.round(value / scale));
    return { column, scale, order, bytes: varints(differences(whole, order)) };
  });
  const json = JSON.stringify({
    format: "faceoff-clip/1",
    kind: "motion",
    contest: "defend",
    episode: 0,
    first: 0,
    step_s: 0.02,
    ...header,
    columns: parts.map(({ column, scale, order, bytes }) => ({
      name: column.name,
      unit: column.unit ?? "",
      scale,
      order,
      first: column.first ?? 0,
      count: column.values.length,
      bytes: bytes.length,
    })),
  });
  return assemble(
    new TextEncoder().encode(json),
    parts.flatMap((part) => part.bytes),
  );
}

/** A clip from the bytes of its header and payload. */
export function assemble(header: Uint8Array, payload: number[]): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(4 + header.length + payload.length);
  new DataView(bytes.buffer).setUint32(0, header.length, true);
  bytes.set(header, 4);
  bytes.set(payload, 4 + header.length);
  return bytes;
}

/** Required columns of a motion clip: the puck by functions of the sample, a still arm. */
export function stillArmColumns(
  samples: number,
  x: (k: number) => number,
  y: (k: number) => number,
): TestColumn[] {
  const column = (name: string, value: (k: number) => number): TestColumn => ({
    name,
    values: Array.from({ length: samples }, (_, k) => value(k)),
  });
  return [
    column("puck_x", x),
    column("puck_y", y),
    ...Array.from({ length: 7 }, (_, i) => column(`q_${i + 1}`, () => i * 0.1)),
  ];
}
