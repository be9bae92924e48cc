/** Offered speeds, as multiples of real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

export interface Ticker {
  /** Asks for `tick` before the next frame. */
  request(tick: (nowMs: number) => void): void;
}

/**
 * Where a replay is, in control steps from sample 0. One clock may drive several viewers: theirs run in step then.
 * It asks for frames only while it plays.
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

  /** The last step of the longest replay that runs by this clock. */
  get last(): number {
    return this.end;
  }

  get playing(): boolean {
    return this.running;
  }

  get speed(): number {
    return this.rate;
  }

  /** Calls `changed` whenever position, speed or playing did. */
  listen(changed: () => void): void {
    this.listeners.add(changed);
  }

  /** Time stands still while a gate says that there is nothing to show at a position. */
  gate(open: (position: number) => boolean): void {
    this.gates.add(open);
  }

  /** Makes room for a replay of so many steps. */
  cover(last: number): void {
    if (last > this.end) {
      this.end = last;
      this.tell();
    }
  }

  seek(position: number): void {
    this.at = Math.min(Math.max(position, 0), this.end);
    this.tell();
  }

  /** To a whole step, `by` steps on; stops playing, as who goes by steps wants to look. */
  step(by: number): void {
    this.running = false;
    const whole = by > 0 ? Math.floor(this.at + 1e-6) : Math.ceil(this.at - 1e-6);
    this.seek(whole + by);
  }

  setSpeed(speed: number): void {
    this.rate = speed;
    this.tell();
  }

  pause(): void {
    if (!this.running) return;
    this.running = false;
    this.tell();
  }

  /** Plays on, from the start if it is at the end. */
  play(): void {
    if (this.running || this.end === 0) return;
    if (this.at >= this.end) this.at = 0;
    this.running = true;
    this.before = null;
    this.tell();
    this.ticker.request(this.tick);
  }

  toggle(): void {
    if (this.running) this.pause();
    else this.play();
  }

  private readonly tick = (nowMs: number): void => {
    if (!this.running) return;
    // A page that was hidden goes on where it was.
    const passed = this.before === null ? 0 : Math.min(nowMs - this.before, 250);
    this.before = nowMs;
    const next = Math.min(this.at + ((passed / 1000) * this.rate) / this.stepS, this.end);
    let open = true;
    for (const gate of this.gates) open = gate(next) && open;
    if (open) {
      this.at = next;
      if (next >= this.end) this.running = false;
      this.tell();
    }
    if (this.running) this.ticker.request(this.tick);
  };

  private tell(): void {
    for (const changed of this.listeners) changed();
  }
}
