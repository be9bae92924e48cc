// The clock of a replay: position, speed and playback.

/** Offered speeds, as multiples of real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16] as const;

/** A source of animation frames. */
export interface Ticker {
  /** Schedules `tick` before the next frame. */
  request(tick: (nowMs: number) => void): void;
}

/** Longest time between two frames that moves the clock; a longer one means that the page was hidden. */
const MAX_FRAME_MS = 250;

/**
 * Position of a replay, in control steps from sample 0. Viewers that share a clock are synchronised. The clock requests
 * frames only while it plays.
 */
export class Clock {
  private current = 0;
  private lastStep = 0;
  private isRunning = false;
  private currentSpeed = 1;
  private previousFrameMs: number | null = null;
  private readonly listeners = new Set<() => void>();
  private readonly gates = new Set<(position: number) => boolean>();

  constructor(
    readonly stepS: number,
    private readonly ticker: Ticker,
  ) {}

  get position(): number {
    return this.current;
  }

  /** Last step of the longest replay of this clock. */
  get last(): number {
    return this.lastStep;
  }

  get playing(): boolean {
    return this.isRunning;
  }

  get speed(): number {
    return this.currentSpeed;
  }

  /** Calls `changed` after each change of position, speed or playback. */
  addListener(changed: () => void): void {
    this.listeners.add(changed);
  }

  /** Adds a gate: time stops while it returns false, because data for the position is missing. */
  addGate(isOpen: (position: number) => boolean): void {
    this.gates.add(isOpen);
  }

  /** Extends the clock to a replay with `last` as its last step. */
  extendTo(last: number): void {
    if (last > this.lastStep) {
      this.lastStep = last;
      this.notify();
    }
  }

  seek(position: number): void {
    this.current = Math.min(Math.max(position, 0), this.lastStep);
    this.notify();
  }

  /** Moves by whole steps and stops playback. */
  step(steps: number): void {
    this.isRunning = false;
    const whole = steps > 0 ? Math.floor(this.current + 1e-6) : Math.ceil(this.current - 1e-6);
    this.seek(whole + steps);
  }

  setSpeed(speed: number): void {
    this.currentSpeed = speed;
    this.notify();
  }

  pause(): void {
    if (!this.isRunning) return;
    this.isRunning = false;
    this.notify();
  }

  /** Starts playback; from the start if the clock is at the end. */
  play(): void {
    if (this.isRunning || this.lastStep === 0) return;
    if (this.current >= this.lastStep) this.current = 0;
    this.isRunning = true;
    this.previousFrameMs = null;
    this.notify();
    this.ticker.request(this.tick);
  }

  toggle(): void {
    if (this.isRunning) this.pause();
    else this.play();
  }

  private readonly tick = (nowMs: number): void => {
    if (!this.isRunning) return;
    // After the page was hidden, playback continues at the same position.
    const elapsedMs =
      this.previousFrameMs === null ? 0 : Math.min(nowMs - this.previousFrameMs, MAX_FRAME_MS);
    this.previousFrameMs = nowMs;
    const next = Math.min(
      this.current + ((elapsedMs / 1000) * this.currentSpeed) / this.stepS,
      this.lastStep,
    );
    let areGatesOpen = true;
    for (const gate of this.gates) areGatesOpen = gate(next) && areGatesOpen;
    if (areGatesOpen) {
      this.current = next;
      if (next >= this.lastStep) this.isRunning = false;
      this.notify();
    }
    if (this.isRunning) this.ticker.request(this.tick);
  };

  private notify(): void {
    for (const changed of this.listeners) changed();
  }
}
