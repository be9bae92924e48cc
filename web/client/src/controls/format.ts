// Numbers and times as text.

/** A number with fixed digits and a true minus sign; zero has no sign. */
export function fixed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return /^-0(\.0+)?$/.test(text) ? text.slice(1) : text.replace("-", "−");
}

export function seconds(step: number, stepS: number): string {
  return `${fixed(step * stepS, 2)} s`;
}

/** Text of the slider at a step. */
export function stepText(step: number, last: number, stepS: number): string {
  return `step ${step} of ${last}, ${seconds(step, stepS)}`;
}
