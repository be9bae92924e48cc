import type { Break } from "../clip/motion";
import { CHUNK_STEPS } from "./source";

/**
 * How a game stands, as far as its loaded chunks tell: the score after the last rally that ended before now, if no
 * chunk between is missing.
 */
export class Score {
  private readonly breaks = new Map<number, readonly Break[]>();

  learn(chunk: number, breaks: readonly Break[]): void {
    this.breaks.set(chunk, breaks);
  }

  at(position: number): readonly [number, number] | null {
    for (let chunk = Math.floor(position / CHUNK_STEPS); chunk >= 0; chunk--) {
      const breaks = this.breaks.get(chunk);
      // The very last sample opens no chunk of its own.
      if (breaks === undefined && position === chunk * CHUNK_STEPS) continue;
      if (breaks === undefined) return null;
      const over = breaks.filter((end) => end.score !== null && end.sample < position).at(-1);
      if (over !== undefined) return over.score;
    }
    return [0, 0];
  }
}
