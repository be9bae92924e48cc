import type { Column } from "../clip/column";
import type { Part } from "./source";

/** Column name with its unit: `puck_x_m`, `dq_1_rad_s`. */
export function columnName(column: Column): string {
  const unit = column.unit.replaceAll(/[^a-z0-9]+/gi, "_");
  return unit === "" || unit === "1" ? column.name : `${column.name}_${unit}`;
}

/** All columns of a part: motion, then observations. */
export function columnsOf(part: Part): readonly Column[] {
  return [...part.motion.columns, ...(part.observed?.columns ?? [])];
}

/** The whole part as CSV, one line per sample; missing values are empty. */
export function csvOf(part: Part): string {
  const columns = columnsOf(part);
  const lines = [["sample", "time_s", ...columns.map(columnName)].join(",")];
  for (let k = 0; k < part.motion.samples; k++) {
    const sample = part.motion.first + k;
    const values = columns.map((column) => plain(column.values[k]));
    lines.push([sample, plain(sample * part.motion.stepS), ...values].join(","));
  }
  return lines.join("\n") + "\n";
}

/** A number without rounding noise in the last digits. */
function plain(value: number | undefined): string {
  return value === undefined || Number.isNaN(value) ? "" : String(Number(value.toPrecision(12)));
}
