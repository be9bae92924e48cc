/** A frame that took longer than this, ms, is slow; one that took longer than that is a pause. */
const SLOW_MS = 45;
const PAUSE_MS = 1500;
/** So many slow frames in a row, and the picture gets plainer. */
const PATIENCE = 8;

interface Level {
  readonly shadows: boolean;
  /** Most device pixels per CSS pixel. */
  readonly ratio: number;
}

const LEVELS: readonly [Level, ...Level[]] = [
  { shadows: true, ratio: 2 },
  { shadows: false, ratio: 1 },
  { shadows: false, ratio: 0.6 },
];

/** How much drawing a machine is asked for; it only ever goes down, so that the picture does not flicker. */
export class Effort {
  private level = LEVELS[0];
  private slow = 0;
  private beforeMs = -Infinity;

  get shadows(): boolean {
    return this.level.shadows;
  }

  get ratio(): number {
    return this.level.ratio;
  }

  /** Takes a frame into account; true if the picture has just become plainer. */
  tooSlow(nowMs: number): boolean {
    const took = nowMs - this.beforeMs;
    this.beforeMs = nowMs;
    this.slow = took > SLOW_MS && took < PAUSE_MS ? this.slow + 1 : 0;
    const next = LEVELS[LEVELS.indexOf(this.level) + 1] as Level | undefined;
    if (this.slow < PATIENCE || next === undefined) return false;
    this.level = next;
    this.slow = 0;
    return true;
  }
}
