// Rendering quality of the 3-D view.

/** A frame that takes longer is slow. */
const SLOW_MS = 45;
/** After a longer time between two frames, the page was paused, for example hidden. */
const PAUSE_MS = 1500;
/** Number of consecutive slow frames before the quality is reduced. */
const SLOW_FRAMES = 8;

/** A level of quality. */
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
  private slowFrames = 0;
  private previousMs = -Infinity;

  get shadows(): boolean {
    return this.level.shadows;
  }

  get ratio(): number {
    return this.level.ratio;
  }

  /** Records a frame; true if the quality was reduced. */
  recordFrame(nowMs: number): boolean {
    const frameMs = nowMs - this.previousMs;
    this.previousMs = nowMs;
    this.slowFrames = frameMs > SLOW_MS && frameMs < PAUSE_MS ? this.slowFrames + 1 : 0;
    const next = LEVELS[LEVELS.indexOf(this.level) + 1] as Level | undefined;
    if (this.slowFrames < SLOW_FRAMES || next === undefined) return false;
    this.level = next;
    this.slowFrames = 0;
    return true;
  }
}
