/** Numbers as they are read: with a true minus, and without one before nothing. */
export function fixed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return /^-0(\.0+)?$/.test(text) ? text.slice(1) : text.replace("-", "−");
}

export function seconds(step: number, stepS: number): string {
  return `${fixed(step * stepS, 2)} s`;
}

/** What a slider at this step is called. */
export function stepWords(step: number, last: number, stepS: number): string {
  return `step ${step} of ${last}, ${seconds(step, stepS)}`;
}
