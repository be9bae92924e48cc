// Switches for the kinds of events on the time line and in the list.

import { EVENT_KINDS, type SwitchedKind } from "../replay/fragment";
import { PART_ONLY_KINDS } from "../replay/course";
import type { EventFilter, ReplayEvent } from "../replay/events";
import { h } from "./dom";

const NAMES: Record<SwitchedKind, string> = {
  goal: "Goals",
  foul: "Fouls",
  rally: "Other ends of rallies",
  violation: "Violations",
  contact: "Contacts",
  lost: "Puck not seen",
  late: "Late answers",
};

/** A check box per kind of event. */
export class EventKinds {
  readonly element = h("div", {
    class: "row kinds",
    attributes: { role: "group", "aria-label": "Kinds of events", hidden: "" },
  });
  private readonly hidden: Set<SwitchedKind>;
  private readonly initial: readonly SwitchedKind[];
  private readonly boxes = new Map<SwitchedKind, { box: HTMLInputElement; row: HTMLElement }>();

  constructor(
    isGame: boolean,
    private readonly changed: () => void,
  ) {
    // In a game, kinds that are known only of loaded parts are off until the visitor switches them on.
    this.initial = isGame ? PART_ONLY_KINDS : [];
    this.hidden = new Set(this.initial);
    for (const kind of EVENT_KINDS) {
      const box = h("input", { attributes: { type: "checkbox" } });
      box.addEventListener("change", () => {
        if (box.checked) this.hidden.delete(kind);
        else this.hidden.add(kind);
        changed();
      });
      const row = h("label", { attributes: { hidden: "" } }, box, NAMES[kind]);
      this.boxes.set(kind, { box, row });
      this.element.append(row);
    }
    this.check();
  }

  /** Is this event shown? How the replay ended always is. */
  shows: EventFilter = (event) => event.kind === "end" || !this.hidden.has(event.kind);

  /** The kinds that are off, if the visitor changed them. */
  get changedKinds(): readonly SwitchedKind[] | undefined {
    const hidden = EVENT_KINDS.filter((kind) => this.hidden.has(kind));
    return hidden.join() === EVENT_KINDS.filter((kind) => this.initial.includes(kind)).join()
      ? undefined
      : hidden;
  }

  hide(kinds: readonly SwitchedKind[]): void {
    this.hidden.clear();
    for (const kind of kinds) this.hidden.add(kind);
    this.check();
    this.changed();
  }

  /** Offers the kinds that occur. */
  offer(events: readonly ReplayEvent[]): void {
    const kinds = new Set(events.map((event) => event.kind));
    for (const [kind, { row }] of this.boxes) row.hidden = row.hidden && !kinds.has(kind);
    this.element.hidden = [...this.boxes.values()].filter(({ row }) => !row.hidden).length < 2;
  }

  private check(): void {
    for (const [kind, { box }] of this.boxes) box.checked = !this.hidden.has(kind);
  }
}
