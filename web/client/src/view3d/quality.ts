/** Frames longer than `SLOW_MS` are slow; longer than `PAUSE_MS`, the page was paused. */
const SLOW_MS = 45;
const PAUSE_MS = 1500;
/** Number of consecutive slow frames before the quality is reduced. */
const SLOW_FRAMES = 8;

interface Level {
  readonly shadows: boolean;
  /** Largest number of device pixels per CSS pixel. */
  readonly ratio: number;
}

const LEVELS: readonly [Level, ...Level[]] = [
  { shadows: true, ratio: 2 },
  { shadows: false, ratio: 1 },
  { shadows: false, ratio: 0.6 },
];

/** Rendering quality, adapted to the machine. It is only ever reduced, so that the picture does not flicker. */
export class RenderQuality {
  private level = LEVELS[0];
  private slow = 0;
  private beforeMs = -Infinity;

  get shadows(): boolean {
    return this.level.shadows;
  }

  get ratio(): number {
    return this.level.ratio;
  }

  /** Records a frame; true if the quality was reduced. */
  recordFrame(nowMs: number): boolean {
    const took = nowMs - this.beforeMs;
    this.beforeMs = nowMs;
    this.slow = took > SLOW_MS && took < PAUSE_MS ? this.slow + 1 : 0;
    const next = LEVELS[LEVELS.indexOf(this.level) + 1] as Level | undefined;
    if (this.slow < SLOW_FRAMES || next === undefined) return false;
    this.level = next;
    this.slow = 0;
    return true;
  }
}
