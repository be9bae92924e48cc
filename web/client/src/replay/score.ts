import type { Break } from "../clip/motion";
import { CHUNK_STEPS } from "./source";

type Standing = readonly [number, number];

/**
 * How a game stands, as far as its loaded chunks tell: the score after the last rally that ended before now. Where no
 * chunk says how it stood at its start, none between may be missing.
 */
export class Score {
  private readonly chunks = new Map<number, { breaks: readonly Break[]; start: Standing | null }>();

  learn(chunk: number, breaks: readonly Break[], start: Standing | null): void {
    this.chunks.set(chunk, { breaks, start });
  }

  at(position: number): Standing | null {
    for (let i = Math.floor(position / CHUNK_STEPS); i >= 0; i--) {
      const chunk = this.chunks.get(i);
      // The very last sample opens no chunk of its own.
      if (chunk === undefined && position === i * CHUNK_STEPS) continue;
      if (chunk === undefined) return null;
      const over = chunk.breaks.findLast((end) => end.score !== null && end.sample < position);
      if (over !== undefined) return over.score;
      if (chunk.start !== null) return chunk.start;
    }
    return [0, 0];
  }
}
