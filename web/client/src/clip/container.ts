// The container format of all clips. A clip is a recording of an episode, or of a chunk of a game: a JSON header and columns of
// values by sample. Sample k is the state after k control steps.

import { Fields } from "./checks";
import { decodeColumn, parseEncoding, type Column } from "./column";
import { ClipError } from "./error";

/** The supported format. */
export const FORMAT = "faceoff-clip/1";

// Far above the needs of an episode or a chunk of a game: a larger file is not a valid clip.
const MAX_SAMPLES = 100_000;
const MAX_HEADER_BYTES = 4 << 20;

/** Common content of all kinds of clips: range of samples, and columns by name. */
export interface Container {
  readonly kind: string;
  readonly header: Fields;
  readonly contest: string;
  /** The episode's index; null for a game. */
  readonly episode: number | null;
  /** Index of the first sample: sample k is the state after k control steps. */
  readonly first: number;
  readonly samples: number;
  readonly stepS: number;
  readonly columns: ReadonlyMap<string, Column>;
}

/** Parses and validates a clip. Only columns accepted by `isNeeded` are decoded. */
export function openContainer(bytes: Uint8Array, isNeeded: (name: string) => boolean): Container {
  if (bytes.length < 4) throw new ClipError(`the clip has ${bytes.length} bytes, less than its first field`);
  const length = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength).getUint32(0, true);
  if (length > MAX_HEADER_BYTES || length > bytes.length - 4) {
    throw new ClipError(
      `the clip ends inside its header (${length} bytes expected, ${bytes.length - 4} received), or is not a clip`,
    );
  }
  const header = Fields.of(readJson(bytes.subarray(4, 4 + length)), "header");
  const format = header.text("format");
  if (format !== FORMAT) {
    throw new ClipError(
      `the replay has the format "${format.slice(0, 40)}", but this page supports "${FORMAT}"; reload the page, which may be older than the server`,
    );
  }
  const samples = header.integer("samples", 1, MAX_SAMPLES);
  const stepS = header.number("step_s");
  if (stepS <= 0) throw header.typeError("step_s", "above 0");

  const columns = new Map<string, Column>();
  let offset = 4 + length;
  for (const entry of header.objects("columns")) {
    const encoding = parseEncoding(entry, samples);
    if (encoding.bytes > bytes.length - offset) {
      throw new ClipError(
        `the clip ends inside column ${encoding.name} (${encoding.bytes} bytes expected, ${bytes.length - offset} received)`,
      );
    }
    if (columns.has(encoding.name)) throw new ClipError(`column ${encoding.name} appears twice`);
    if (isNeeded(encoding.name))
      columns.set(
        encoding.name,
        decodeColumn(encoding, bytes.subarray(offset, offset + encoding.bytes), samples),
      );
    offset += encoding.bytes;
  }
  if (offset !== bytes.length)
    throw new ClipError(`the clip has ${bytes.length - offset} bytes after its last column`);

  return {
    kind: header.text("kind"),
    header,
    contest: header.text("contest"),
    episode: header.has("episode") ? header.integer("episode", 0, Number.MAX_SAFE_INTEGER) : null,
    first: header.integer("first", 0, Number.MAX_SAFE_INTEGER),
    samples,
    stepS,
    columns,
  };
}

function readJson(bytes: Uint8Array): unknown {
  try {
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes)) as unknown;
  } catch {
    throw new ClipError("the clip's header is not JSON in UTF-8");
  }
}
