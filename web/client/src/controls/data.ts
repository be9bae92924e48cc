// The recorded values around the cursor as a table, and their download as CSV.

import { columnName, columnsOf, csvOf } from "../replay/csv";
import type { ReplayPart } from "../replay/source";
import { button, h } from "./dom";
import { fixed } from "./format";

/** Rows before and after the row of the cursor. */
const ROWS_EACH_SIDE = 5;

/** A table of samples around the cursor, and a download of all samples. */
export class DataTable {
  readonly element: HTMLDetailsElement;
  private readonly head = h("tr");
  private readonly body = h("tbody");
  private part: ReplayPart | null = null;
  private cells: HTMLElement[][] = [];
  private rows: HTMLElement[] = [];
  private step = -1;

  constructor(private readonly title: string) {
    const save = button("Download all as CSV", () => {
      if (this.part !== null)
        saveFile(
          new Blob([csvOf(this.part)], { type: "text/csv" }),
          `${fileName(this.title, this.part)}.csv`,
        );
    });
    this.element = h(
      "details",
      { class: "data" },
      h("summary", {}, "Data as a table"),
      h("p", {}, save),
      h(
        "div",
        {
          class: "wide",
          attributes: { tabindex: "0", role: "region", "aria-label": `Samples around the cursor: ${title}` },
        },
        h("table", {}, h("thead", {}, this.head), this.body),
      ),
    );
    this.element.addEventListener("toggle", () => {
      this.fill();
    });
  }

  show(part: ReplayPart): void {
    this.part = part;
    const columns = columnsOf(part);
    this.head.replaceChildren(
      ...["sample", "time_s", ...columns.map(columnName)].map((name) =>
        h("th", { class: "number", attributes: { scope: "col" } }, name),
      ),
    );
    this.rows = [];
    this.cells = Array.from({ length: 2 * ROWS_EACH_SIDE + 1 }, () => {
      const sample = h("th", { class: "number", attributes: { scope: "row" } });
      const cells = Array.from({ length: columns.length + 1 }, () => h("td", { class: "number" }));
      this.rows.push(h("tr", {}, sample, ...cells));
      return [sample, ...cells];
    });
    this.body.replaceChildren(...this.rows);
    this.fill();
  }

  update(step: number): void {
    if (step === this.step) return;
    this.step = step;
    this.fill();
  }

  private fill(): void {
    const { part } = this;
    if (!this.element.open || part === null) return;
    const { first, samples, stepS } = part.motion;
    const columns = columnsOf(part);
    this.cells.forEach((cells, row) => {
      const k = this.step - first + row - ROWS_EACH_SIDE;
      const exists = k >= 0 && k < samples;
      this.rows[row].hidden = !exists;
      if (!exists) return;
      if (row === ROWS_EACH_SIDE) this.rows[row].setAttribute("aria-current", "step");
      cells[0].textContent = String(first + k);
      cells[1].textContent = fixed((first + k) * stepS, 2);
      columns.forEach((column, i) => {
        const value = column.values[k];
        cells[i + 2].textContent = Number.isNaN(value) ? "–" : fixed(value, 4);
      });
    });
  }
}

/** Name of a file with data of a part, without its extension. */
export function fileName(title: string, part: ReplayPart): string {
  const slug = title
    .toLowerCase()
    .replaceAll(/[^a-z0-9]+/g, "-")
    .replaceAll(/^-|-$/g, "");
  return `${slug || "replay"}-${part.motion.first}`;
}

/** Saves content as a download of the browser. */
export function saveFile(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  const link = h("a", { attributes: { href: address, download: name } });
  link.click();
  // The browser reads the blob asynchronously, within a few seconds at most.
  setTimeout(() => {
    URL.revokeObjectURL(address);
  }, 10_000);
}
