// Search for the nearest event, in further parts of a game if necessary.

import type { EventFilter, ReplayEvent } from "./events";
import type { Source } from "./source";

/** The start, direction and filter of a search for an event. */
export interface EventQuery {
  readonly from: number;
  readonly direction: 1 | -1;
  readonly shows: EventFilter;
}

/** The nearest of some events, which are in order of time. */
export function nearestOf(
  events: readonly ReplayEvent[],
  { from, direction, shows }: EventQuery,
): ReplayEvent | null {
  const isFound = (event: ReplayEvent): boolean =>
    shows(event) && (direction === 1 ? event.position > from + 1e-4 : event.position < from - 1e-4);
  return (direction === 1 ? events.find(isFound) : events.findLast(isFound)) ?? null;
}

/** The nearest event of a replay of which only some parts are known. `load`: makes the events of a part known. */
export async function nearestInParts(
  source: Pick<Source, "indexOf" | "startOf">,
  knownEvents: () => readonly ReplayEvent[],
  load: (index: number, start: number) => Promise<void>,
  query: EventQuery,
): Promise<ReplayEvent | null> {
  const { from, direction } = query;
  for (let index = source.indexOf(from); ; index += direction) {
    const start = source.startOf(index);
    if (start === null) return nearestOf(knownEvents(), query);
    await load(index, start);
    const found = nearestOf(knownEvents(), query);
    // Before a known event of a later part, parts that are not loaded may have a nearer one.
    if (found !== null && (source.indexOf(found.position) - index) * direction <= 0) return found;
  }
}
