/** Offered speeds, as multiples of real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

export interface Ticker {
  /** Schedules `tick` before the next frame. */
  request(tick: (nowMs: number) => void): void;
}

/**
 * Position of a replay, in control steps from sample 0. Viewers that share a clock are synchronised. The clock requests
 * frames only while it plays.
 */
export class Clock {
  private at = 0;
  private end = 0;
  private running = false;
  private rate = 1;
  private before: number | null = null;
  private readonly listeners = new Set<() => void>();
  private readonly gates = new Set<(position: number) => boolean>();

  constructor(
    readonly stepS: number,
    private readonly ticker: Ticker,
  ) {}

  get position(): number {
    return this.at;
  }

  /** Last step of the longest replay of this clock. */
  get last(): number {
    return this.end;
  }

  get playing(): boolean {
    return this.running;
  }

  get speed(): number {
    return this.rate;
  }

  /** Calls `changed` after each change of position, speed or playback. */
  listen(changed: () => void): void {
    this.listeners.add(changed);
  }

  /** Time stops while a gate returns false because data for the position is missing. */
  gate(open: (position: number) => boolean): void {
    this.gates.add(open);
  }

  /** Extends the clock to a replay with `last` as its last step. */
  cover(last: number): void {
    if (last > this.end) {
      this.end = last;
      this.notify();
    }
  }

  seek(position: number): void {
    this.at = Math.min(Math.max(position, 0), this.end);
    this.notify();
  }

  /** Moves by whole steps and stops playback. */
  step(by: number): void {
    this.running = false;
    const whole = by > 0 ? Math.floor(this.at + 1e-6) : Math.ceil(this.at - 1e-6);
    this.seek(whole + by);
  }

  setSpeed(speed: number): void {
    this.rate = speed;
    this.notify();
  }

  pause(): void {
    if (!this.running) return;
    this.running = false;
    this.notify();
  }

  /** Starts playback; from the start if the clock is at the end. */
  play(): void {
    if (this.running || this.end === 0) return;
    if (this.at >= this.end) this.at = 0;
    this.running = true;
    this.before = null;
    this.notify();
    this.ticker.request(this.tick);
  }

  toggle(): void {
    if (this.running) this.pause();
    else this.play();
  }

  private readonly tick = (nowMs: number): void => {
    if (!this.running) return;
    // After the page was hidden, playback continues at the same position.
    const passed = this.before === null ? 0 : Math.min(nowMs - this.before, 250);
    this.before = nowMs;
    const next = Math.min(this.at + ((passed / 1000) * this.rate) / this.stepS, this.end);
    let open = true;
    for (const gate of this.gates) open = gate(next) && open;
    if (open) {
      this.at = next;
      if (next >= this.end) this.running = false;
      this.notify();
    }
    if (this.running) this.ticker.request(this.tick);
  };

  private notify(): void {
    for (const changed of this.listeners) changed();
  }
}
