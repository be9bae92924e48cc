// Loading of clips. A replay is shown in parts: an episode has one part; a game has a part for each chunk of 500 control steps.

import { ClipError } from "../clip/error";
import { decodeMotion, type Motion } from "../clip/motion";
import { decodeObserved, type Observed } from "../clip/observed";
import { Interpolation } from "../motion/pose";
import { pathsOf, type Paths } from "../motion/paths";

/** Steps per chunk of a game. */
export const CHUNK_STEPS = 500;

/** Number of cached chunks: the current one, the next one and recent ones. */
const MAX_CACHED = 6;

/** Addresses of the clips of a replay. Addresses of a game contain `{chunk}` for the number of the chunk. */
export interface Addresses {
  readonly motion: string;
  readonly observed: string | null;
  /** Samples of a game; null for an episode, whose clip contains the number. */
  readonly samples: number | null;
}

/** An episode, or a chunk of a game, ready to be drawn. */
export interface ReplayPart {
  /** Number of the chunk; 0 for an episode. */
  readonly index: number;
  readonly motion: Motion;
  readonly observed: Observed | null;
  /** Why observations are missing although an address was given. */
  readonly observationError: string | null;
  readonly interpolation: Interpolation;
  readonly paths: Paths;
}

/** Fetches the parts of a replay on demand and caches a few. */
export class Source {
  private readonly parts = new Map<number, ReplayPart>();
  private readonly pending = new Map<number, Promise<ReplayPart>>();

  constructor(
    private readonly addresses: Addresses,
    private readonly fetchFile: typeof fetch,
  ) {}

  private get chunkCount(): number {
    const { samples } = this.addresses;
    return samples === null ? 1 : Math.max(Math.ceil((samples - 1) / CHUNK_STEPS), 1);
  }

  /** Index of the part at a time of the replay, in control steps from sample 0; between steps it is a fraction. */
  indexOf(stepPosition: number): number {
    if (this.addresses.samples === null) return 0;
    return Math.min(Math.max(Math.floor(stepPosition / CHUNK_STEPS), 0), this.chunkCount - 1);
  }

  /** The control step at which a part starts; null if there is no such part. */
  startOf(index: number): number | null {
    return index >= 0 && index < this.chunkCount ? index * CHUNK_STEPS : null;
  }

  /** The part at a time of the replay, in control steps, if it is loaded. */
  loadedPartAt(stepPosition: number): ReplayPart | null {
    return this.parts.get(this.indexOf(stepPosition)) ?? null;
  }

  async partAt(stepPosition: number): Promise<ReplayPart> {
    return this.loadOnce(this.indexOf(stepPosition));
  }

  /** Starts to fetch the `count` parts after this time, in control steps. A failure is reported when the part is needed. */
  prefetch(stepPosition: number, count: number): void {
    const current = this.indexOf(stepPosition);
    for (let next = current + 1; next <= current + count && next < this.chunkCount; next++)
      this.loadOnce(next).catch(() => undefined);
  }

  private async loadOnce(index: number): Promise<ReplayPart> {
    const cached = this.parts.get(index);
    if (cached !== undefined) {
      // Most recently used last.
      this.parts.delete(index);
      this.parts.set(index, cached);
      return cached;
    }
    let pending = this.pending.get(index);
    if (pending === undefined) {
      pending = this.load(index).finally(() => this.pending.delete(index));
      this.pending.set(index, pending);
    }
    return pending;
  }

  private async load(index: number): Promise<ReplayPart> {
    const address = (pattern: string): string => pattern.replace("{chunk}", String(index));
    const [motion, observed] = await Promise.all([
      this.fetchBytes(address(this.addresses.motion)).then(decodeMotion),
      this.fetchObserved(this.addresses.observed === null ? null : address(this.addresses.observed)),
    ]);
    const interpolation = new Interpolation(motion);
    const seen = observed.observed;
    const hasSameSamples = seen === null || (seen.first === motion.first && seen.samples === motion.samples);
    const part = {
      index,
      motion,
      observed: hasSameSamples ? seen : null,
      observationError: hasSameSamples
        ? observed.observationError
        : "its samples differ from those of the motion",
      interpolation,
      paths: pathsOf(motion, interpolation, hasSameSamples ? seen : null),
    };
    this.parts.set(index, part);
    for (const oldest of this.parts.keys()) {
      if (this.parts.size <= MAX_CACHED) break;
      this.parts.delete(oldest);
    }
    return part;
  }

  /** A failure is not fatal: the motion is shown without observations. */
  private async fetchObserved(
    address: string | null,
  ): Promise<{ observed: Observed | null; observationError: string | null }> {
    if (address === null) return { observed: null, observationError: null };
    try {
      return { observed: decodeObserved(await this.fetchBytes(address)), observationError: null };
    } catch (error) {
      return { observed: null, observationError: errorText(error) };
    }
  }

  private async fetchBytes(address: string): Promise<Uint8Array> {
    let response: Response;
    try {
      response = await this.fetchFile(address, { headers: { Accept: "application/octet-stream" } });
    } catch {
      throw new ClipError("the server could not be reached");
    }
    if (!response.ok) throw new ClipError(statusText(response.status));
    return new Uint8Array(await response.arrayBuffer());
  }
}

/** Message of an error for the visitor. */
export function errorText(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

function statusText(status: number): string {
  if (status === 401 || status === 403) return "access denied; sign in as a member of the team";
  if (status === 404 || status === 410) return "the server has no recording, or it was deleted";
  if (status === 429) return "too many requests; try again in a moment";
  return `the server answered with status ${status}`;
}
