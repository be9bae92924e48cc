// Recorded values as CSV.

import type { Column } from "../clip/column";
import type { ReplayPart } from "./source";

/** Column name with its unit: `puck_x_m`, `dq_1_rad_s`. */
export function columnName(column: Column): string {
  const unit = column.unit.replaceAll(/[^a-z0-9]+/gi, "_");
  return unit === "" || unit === "1" ? column.name : `${column.name}_${unit}`;
}

/** All columns of a part: motion, then observations. */
export function columnsOf(part: ReplayPart): readonly Column[] {
  return [...part.motion.columns, ...(part.observed?.columns ?? [])];
}

/** The whole part as CSV, one line per sample; missing values are empty. */
export function csvOf(part: ReplayPart): string {
  const columns = columnsOf(part);
  const lines = [["sample", "time_s", ...columns.map(columnName)].join(",")];
  for (let index = 0; index < part.motion.samples; index++) {
    const sample = part.motion.first + index;
    const values = columns.map((column) => numberText(column.values[index]));
    lines.push([sample, numberText(sample * part.motion.stepS), ...values].join(","));
  }
  return lines.join("\n") + "\n";
}

/** A number without rounding noise in the last digits. */
function numberText(value: number | undefined): string {
  return value === undefined || Number.isNaN(value) ? "" : String(Number(value.toPrecision(12)));
}
