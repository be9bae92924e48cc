import { ClipError } from "./error";
import type { Column } from "./column";
import { openContainer } from "./container";
import { family } from "./motion";

/** Samples without a camera observation of the puck, inclusive. */
export interface Lost {
  readonly from: number;
  readonly to: number;
}

/** Observations and commands of the agent; all arrays are indexed by sample − `first`. */
export interface Observed {
  readonly first: number;
  readonly samples: number;
  readonly side: 0 | 1;
  readonly seenX: Float64Array | null;
  readonly seenY: Float64Array | null;
  readonly command: readonly Float64Array[] | null;
  readonly computationTimeS: Float64Array | null;
  readonly hostTimeS: Float64Array | null;
  /** Samples with a late answer. */
  readonly late: readonly number[];
  readonly lost: readonly Lost[];
  readonly columns: readonly Column[];
}

const KNOWN = /^(seen_(x|y|yaw)|command_[1-7]|computation_time|host_time)$/;

export function decodeObserved(bytes: Uint8Array): Observed {
  const container = openContainer(bytes, (name) => KNOWN.test(name));
  if (container.kind !== "observed") {
    throw new ClipError(`expected a clip of kind "observed", got "${container.kind}"`);
  }
  const { header, columns } = container;
  const most = Number.MAX_SAFE_INTEGER;
  return {
    first: container.first,
    samples: container.samples,
    side: header.has("side") && header.whole("side", 0, 1) === 1 ? 1 : 0,
    seenX: columns.get("seen_x")?.values ?? null,
    seenY: columns.get("seen_y")?.values ?? null,
    command: family(container, "command", 7),
    computationTimeS: columns.get("computation_time")?.values ?? null,
    hostTimeS: columns.get("host_time")?.values ?? null,
    late: header.list("late").map(({ at, value }) => {
      if (typeof value !== "number" || !Number.isInteger(value))
        throw new ClipError(`${at} must be a sample`);
      return value;
    }),
    lost: header
      .objects("lost")
      .map((entry) => ({ from: entry.whole("from", 0, most), to: entry.whole("to", 0, most) })),
    columns: [...columns.values()],
  };
}
