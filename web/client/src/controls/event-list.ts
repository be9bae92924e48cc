// The list of events below the picture.

import type { ReplayEvent } from "../replay/events";
import { h } from "./dom";
import { seconds } from "./format";

/** List of events; each is a button that seeks to it. */
export class EventList {
  readonly element: HTMLDetailsElement;
  private readonly list = h("ol");
  private readonly summary = h("summary", {}, "Events");
  private buttons: HTMLButtonElement[] = [];
  private events: readonly ReplayEvent[] = [];
  private current = -1;

  constructor(private readonly seekToEvent: (event: ReplayEvent) => void) {
    this.element = h("details", { class: "events", attributes: { open: "" } }, this.summary, this.list);
  }

  show(events: readonly ReplayEvent[], stepS: number, note: string): void {
    this.events = events;
    this.current = -1;
    this.summary.textContent = events.length === 0 ? `No events${note}` : `Events (${events.length}${note})`;
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
        h("span", { class: "event-time" }, seconds(event.position, stepS)),
        h(
          "span",
          { class: `event-symbol ${event.kind}`, attributes: { "aria-hidden": "true" } },
          event.symbol,
        ),
        h("span", {}, event.text),
      ),
    );
    this.list.replaceChildren(...this.buttons.map((button) => h("li", {}, button)));
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
  }
}
