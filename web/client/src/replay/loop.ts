/** One callback per frame for everything: clocks tick first, then is drawn what they changed. */
export class FrameLoop {
  private ticks: ((nowMs: number) => void)[] = [];
  private draws: ((nowMs: number) => void)[] = [];
  private asked = false;

  /** Before anything is drawn in the next frame. */
  request(tick: (nowMs: number) => void): void {
    this.ticks.push(tick);
    this.ask();
  }

  /** In the next frame, or in this one if a clock asks for it. */
  draw(draw: (nowMs: number) => void): void {
    this.draws.push(draw);
    this.ask();
  }

  private ask(): void {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(this.run);
  }

  private readonly run = (nowMs: number): void => {
    const ticks = this.ticks;
    this.ticks = [];
    for (const tick of ticks) tick(nowMs);
    const draws = this.draws;
    this.draws = [];
    this.asked = false;
    for (const draw of draws) draw(nowMs);
    // Ticks and draws may have asked for more.
    if (this.ticks.length > 0 || this.draws.length > 0) this.ask();
  };
}
