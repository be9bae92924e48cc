// Numbers and times as text.

/** A number with fixed digits and a true minus sign; zero has no sign. */
export function fixed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return /^-0(\.0+)?$/.test(text) ? text.slice(1) : text.replace("-", "−");
}

/** How times are written: seconds in an episode, minutes and seconds in a game. */
export interface TimeFormat {
  readonly stepS: number;
  readonly hasMinutes: boolean;
}

/** The time of a control step: `1.24 s`, or `7:28`. */
export function timeText(step: number, { stepS, hasMinutes }: TimeFormat): string {
  if (!hasMinutes) return `${fixed(step * stepS, 2)} s`;
  // A step that begins a second is not rounded down to the second before.
  const whole = Math.floor(step * stepS + 1e-6);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

/** Text of the slider at a step. */
export function stepText(step: number, last: number, format: TimeFormat): string {
  return format.hasMinutes
    ? `${timeText(step, format)} of ${timeText(last, format)}`
    : `step ${step} of ${last}, ${timeText(step, format)}`;
}
