// The score of a game at any position of the replay: a time in control steps.

import type { RallyEnd } from "../clip/motion";
import { CHUNK_STEPS } from "./source";

type GameScore = readonly [number, number];

/**
 * The score of a game at a position, from the loaded chunks: the score after the last rally before it. A chunk without a
 * start score needs all chunks before it.
 */
export class Score {
  private readonly chunks = new Map<number, { rallyEnds: readonly RallyEnd[]; start: GameScore | null }>();

  /** Adds a loaded chunk with its ends of rallies and the score at its start, if recorded. */
  addChunk(chunk: number, rallyEnds: readonly RallyEnd[], start: GameScore | null): void {
    this.chunks.set(chunk, { rallyEnds, start });
  }

  at(position: number): GameScore | null {
    for (let i = Math.floor(position / CHUNK_STEPS); i >= 0; i--) {
      const chunk = this.chunks.get(i);
      // The last sample of the game does not start another chunk.
      if (chunk === undefined && position === i * CHUNK_STEPS) continue;
      if (chunk === undefined) return null;
      const last = chunk.rallyEnds.findLast((end) => end.score !== null && end.sample < position);
      if (last !== undefined) return last.score;
      if (chunk.start !== null) return chunk.start;
    }
    return [0, 0];
  }
}
