// The list of events beside or below the picture.

import type { ReplayEvent } from "../replay/events";
import { button, h } from "./dom";
import { timeText, type TimeFormat } from "./format";

/** Rows of the short list before the current event. */
const ROWS_BEFORE = 4;
/** All rows of the short list. */
const ROWS = 12;

/** List of events; each is a button that seeks to it. A long list is short at first, and follows the current event. */
export class EventList {
  readonly element: HTMLElement;
  private readonly list = h("ol");
  private readonly heading = h("h2", { class: "heading" }, "Events");
  private readonly whole = button("", () => { this.toggleWhole(); }); // prettier-ignore
  private rows: HTMLElement[] = [];
  private buttons: HTMLButtonElement[] = [];
  private events: readonly ReplayEvent[] = [];
  private current = -1;
  private isWhole = false;

  constructor(private readonly seekToEvent: (event: ReplayEvent) => void) {
    this.element = h("div", { class: "events" }, this.heading, this.list, this.whole);
  }

  show(events: readonly ReplayEvent[], format: TimeFormat, note: string): void {
    this.events = events;
    this.current = -1;
    this.heading.textContent = events.length === 0 ? `No events${note}` : `Events (${events.length}${note})`;
    this.buttons = events.map((event) =>
      h(
        "button",
        {
          attributes: { type: "button" },
          on: {
            click: () => {
              this.seekToEvent(event);
            },
          },
        },
        h("span", { class: "event-time" }, timeText(event.position, format)),
        h(
          "span",
          {
            class: `event-symbol ${event.kind}${event.side === null ? "" : ` side-${event.side + 1}`}`,
            attributes: { "aria-hidden": "true" },
          },
          event.symbol,
        ),
        h("span", {}, event.text),
      ),
    );
    this.rows = this.buttons.map((button) => h("li", {}, button));
    this.list.replaceChildren(...this.rows);
    this.showRows();
  }

  /** Marks the last event at or before a position. */
  update(position: number): void {
    // Search from the current event, which usually moves by one at most.
    let current = this.current;
    while (current >= 0 && this.events[current].position > position + 1e-6) current--;
    while (current + 1 < this.events.length && this.events[current + 1].position <= position + 1e-6)
      current++;
    if (current === this.current) return;
    this.buttons[this.current]?.removeAttribute("aria-current");
    this.buttons[current]?.setAttribute("aria-current", "step");
    this.current = current;
    if (!this.isWhole) this.showRows();
  }

  private toggleWhole(): void {
    this.isWhole = !this.isWhole;
    this.showRows();
  }

  private showRows(): void {
    const { length } = this.rows;
    const first = this.isWhole ? 0 : Math.max(Math.min(this.current - ROWS_BEFORE, length - ROWS), 0);
    const end = this.isWhole ? length : first + ROWS;
    this.rows.forEach((row, i) => {
      // The focused row stays, so that the keyboard keeps its place.
      const isHidden = (i < first || i >= end) && this.buttons[i] !== document.activeElement;
      if (row.hidden !== isHidden) row.hidden = isHidden;
    });
    this.whole.hidden = length <= ROWS;
    this.whole.textContent = this.isWhole ? "Show fewer events" : `Show all ${length} events`;
  }
}
