// The observed clip: what the agent observed and commanded, and how long its answers took. Visible to its team until the
// dataset is public.

import { ClipError } from "./error";
import type { Column } from "./column";
import { openContainer } from "./container";
import { numberedColumns } from "./motion";

/** Samples without a camera observation of the puck, inclusive. */
export interface TrackingLoss {
  readonly from: number;
  readonly to: number;
}

/** Observations and commands of the agent; all arrays are indexed by sample − `first`. */
export interface Observed {
  readonly first: number;
  readonly samples: number;
  /** Side of the agent: 0 robot 1, 1 robot 2. */
  readonly side: 0 | 1;
  /** Observed position of the puck in the table frame, m. */
  readonly seenX: Float64Array | null;
  readonly seenY: Float64Array | null;
  /** Commanded angles of the seven joints, rad. */
  readonly command: readonly Float64Array[] | null;
  readonly computationTimeS: Float64Array | null;
  /** Host interference: the part of the wall time that other load caused, which `computationTimeS` does not include. */
  readonly hostTimeS: Float64Array | null;
  /** Samples with a late answer. */
  readonly late: readonly number[];
  readonly lost: readonly TrackingLoss[];
  readonly columns: readonly Column[];
}

/** Names of the columns that are decoded. */
const OBSERVED_COLUMNS = /^(seen_(x|y|yaw)|command_[1-7]|computation_time|host_time)$/;

export function decodeObserved(bytes: Uint8Array): Observed {
  const container = openContainer(bytes, (name) => OBSERVED_COLUMNS.test(name));
  if (container.kind !== "observed") {
    throw new ClipError(`expected a clip of kind "observed", got "${container.kind}"`);
  }
  const { header, columns } = container;
  const max = Number.MAX_SAFE_INTEGER;
  return {
    first: container.first,
    samples: container.samples,
    side: header.has("side") && header.integer("side", 0, 1) === 1 ? 1 : 0,
    seenX: columns.get("seen_x")?.values ?? null,
    seenY: columns.get("seen_y")?.values ?? null,
    command: numberedColumns(container, "command", 7),
    computationTimeS: columns.get("computation_time")?.values ?? null,
    hostTimeS: columns.get("host_time")?.values ?? null,
    late: header.list("late").map(({ path, value }) => {
      if (typeof value !== "number" || !Number.isInteger(value))
        throw new ClipError(`${path} must be a sample`);
      return value;
    }),
    lost: header
      .objects("lost")
      .map((entry) => ({ from: entry.integer("from", 0, max), to: entry.integer("to", 0, max) })),
    columns: [...columns.values()],
  };
}
