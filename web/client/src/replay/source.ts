import { ClipError } from "../clip/error";
import { decodeMotion, type Motion } from "../clip/motion";
import { decodeObserved, type Observed } from "../clip/observed";
import { Interpolation } from "../motion/pose";
import { pathsOf, type Paths } from "../motion/paths";

/** Steps of a game that one of its chunks holds. */
export const CHUNK_STEPS = 500;

/** Chunks that are kept: the one on show, the next one, and where one just came from. */
const KEPT = 6;

/** Where a replay's clips are. A game's addresses have `{chunk}` for the number of the chunk. */
export interface Addresses {
  readonly motion: string;
  readonly observed: string | null;
  /** Samples of a game; null for an episode, whose one clip says it. */
  readonly samples: number | null;
}

/** An episode, or a chunk of a game, ready to be drawn. */
export interface Part {
  readonly index: number;
  readonly motion: Motion;
  readonly observed: Observed | null;
  /** Why there is nothing observed although it was asked for. */
  readonly unobserved: string | null;
  readonly interpolation: Interpolation;
  readonly paths: Paths;
}

/** Fetches the parts of a replay as they are needed, and keeps a few. */
export class Source {
  private readonly parts = new Map<number, Part>();
  private readonly under = new Map<number, Promise<Part>>();

  constructor(
    private readonly addresses: Addresses,
    private readonly get: typeof fetch,
  ) {}

  private get chunks(): number {
    const { samples } = this.addresses;
    return samples === null ? 1 : Math.max(Math.ceil((samples - 1) / CHUNK_STEPS), 1);
  }

  indexOf(position: number): number {
    if (this.addresses.samples === null) return 0;
    return Math.min(Math.max(Math.floor(position / CHUNK_STEPS), 0), this.chunks - 1);
  }

  /** The position at which a part starts; null if there is no such part. */
  startOf(index: number): number | null {
    return index >= 0 && index < this.chunks ? index * CHUNK_STEPS : null;
  }

  /** The part at a position if it is here. */
  here(position: number): Part | null {
    return this.parts.get(this.indexOf(position)) ?? null;
  }

  async at(position: number): Promise<Part> {
    return this.part(this.indexOf(position));
  }

  /** Fetches the part after this position, without waiting; a failure shows when the part is needed. */
  prefetch(position: number): void {
    const next = this.indexOf(position) + 1;
    if (next < this.chunks) this.part(next).catch(() => undefined);
  }

  private async part(index: number): Promise<Part> {
    const here = this.parts.get(index);
    if (here !== undefined) {
      // Most recently used last.
      this.parts.delete(index);
      this.parts.set(index, here);
      return here;
    }
    let coming = this.under.get(index);
    if (coming === undefined) {
      coming = this.load(index).finally(() => this.under.delete(index));
      this.under.set(index, coming);
    }
    return coming;
  }

  private async load(index: number): Promise<Part> {
    const address = (pattern: string): string => pattern.replace("{chunk}", String(index));
    const [motion, observed] = await Promise.all([
      this.bytes(address(this.addresses.motion)).then(decodeMotion),
      this.observed(this.addresses.observed === null ? null : address(this.addresses.observed)),
    ]);
    const interpolation = new Interpolation(motion);
    const seen = observed.observed;
    const fits = seen === null || (seen.first === motion.first && seen.samples === motion.samples);
    const part = {
      index,
      motion,
      observed: fits ? seen : null,
      unobserved: fits ? observed.unobserved : "it is of other samples than the motion",
      interpolation,
      paths: pathsOf(motion, interpolation, fits ? seen : null),
    };
    this.parts.set(index, part);
    for (const oldest of this.parts.keys()) {
      if (this.parts.size <= KEPT) break;
      this.parts.delete(oldest);
    }
    return part;
  }

  /** The motion is worth showing without what was observed. */
  private async observed(
    address: string | null,
  ): Promise<{ observed: Observed | null; unobserved: string | null }> {
    if (address === null) return { observed: null, unobserved: null };
    try {
      return { observed: decodeObserved(await this.bytes(address)), unobserved: null };
    } catch (error) {
      return { observed: null, unobserved: wordsOf(error) };
    }
  }

  private async bytes(address: string): Promise<Uint8Array> {
    let answer: Response;
    try {
      answer = await this.get(address, { headers: { Accept: "application/octet-stream" } });
    } catch {
      throw new ClipError("the server could not be reached");
    }
    if (!answer.ok) throw new ClipError(refusal(answer.status));
    return new Uint8Array(await answer.arrayBuffer());
  }
}

/** What to tell the reader of a failure. */
export function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

function refusal(status: number): string {
  if (status === 401 || status === 403) return "you may not see it; sign in with the team that it belongs to";
  if (status === 404 || status === 410) return "the server has no recording of it (any more)";
  if (status === 429) return "the server is asked too much at the moment; wait a little";
  return `the server answered with status ${status}`;
}
