// The animation loop of a page.

/** One animation frame callback for all viewers: clocks tick first, then viewers draw. */
export class FrameLoop {
  private ticks: ((nowMs: number) => void)[] = [];
  private draws: ((nowMs: number) => void)[] = [];
  private isRequested = false;

  /** Schedules `tick` before drawing in the next frame. */
  request(tick: (nowMs: number) => void): void {
    this.ticks.push(tick);
    this.requestFrame();
  }

  /** Schedules `draw` in the next frame, or in the current one if called by a tick. */
  draw(draw: (nowMs: number) => void): void {
    this.draws.push(draw);
    this.requestFrame();
  }

  private requestFrame(): void {
    if (this.isRequested) return;
    this.isRequested = true;
    requestAnimationFrame(this.run);
  }

  private readonly run = (nowMs: number): void => {
    const ticks = this.ticks;
    this.ticks = [];
    for (const tick of ticks) tick(nowMs);
    const draws = this.draws;
    this.draws = [];
    this.isRequested = false;
    for (const draw of draws) draw(nowMs);
    // Ticks and draws may have scheduled more.
    if (this.ticks.length > 0 || this.draws.length > 0) this.requestFrame();
  };
}
