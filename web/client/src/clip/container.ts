import { Fields } from "./checks";
import { decodeColumn, planOf, type Column } from "./column";
import { ClipError } from "./error";

/** The format that is read; others are refused by name. */
export const FORMAT = "faceoff-clip/1";

// Far above what an episode or a game's chunk needs: whatever claims more is not one of our clips.
const MOST_SAMPLES = 100_000;
const MOST_HEADER_BYTES = 4 << 20;

/** What every kind of clip has: which samples, and the columns by name. */
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

/** Takes a clip apart, keeping the columns that `wanted` names; everything is checked before it is believed. */
export function openContainer(bytes: Uint8Array, wanted: (name: string) => boolean): Container {
  if (bytes.length < 4)
    throw new ClipError(`the clip has ${bytes.length} bytes, which is less than its first field`);
  const length = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength).getUint32(0, true);
  if (length > MOST_HEADER_BYTES || length > bytes.length - 4) {
    throw new ClipError(
      `the clip ends inside its header (${length} bytes announced, ${bytes.length - 4} there), or is no clip at all`,
    );
  }
  const header = Fields.of(readJson(bytes.subarray(4, 4 + length)), "header");
  const format = header.text("format");
  if (format !== FORMAT) {
    throw new ClipError(
      `the replay is written as "${format.slice(0, 40)}", and this page reads "${FORMAT}"; reload the page, which may be older than the server`,
    );
  }
  const samples = header.whole("samples", 1, MOST_SAMPLES);
  const stepS = header.number("step_s");
  if (stepS <= 0) throw header.wrong("step_s", "above 0");

  const columns = new Map<string, Column>();
  let at = 4 + length;
  for (const entry of header.objects("columns")) {
    const plan = planOf(entry, samples);
    if (plan.bytes > bytes.length - at) {
      throw new ClipError(
        `the clip ends inside column ${plan.name} (${plan.bytes} bytes announced, ${bytes.length - at} there)`,
      );
    }
    if (columns.has(plan.name)) throw new ClipError(`column ${plan.name} is there twice`);
    if (wanted(plan.name))
      columns.set(plan.name, decodeColumn(plan, bytes.subarray(at, at + plan.bytes), samples));
    at += plan.bytes;
  }
  if (at !== bytes.length)
    throw new ClipError(`the clip has ${bytes.length - at} bytes after its last column`);

  return {
    kind: header.text("kind"),
    header,
    contest: header.text("contest"),
    episode: header.has("episode") ? header.whole("episode", 0, Number.MAX_SAFE_INTEGER) : null,
    first: header.whole("first", 0, Number.MAX_SAFE_INTEGER),
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
