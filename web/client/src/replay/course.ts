// The course of a whole game: its rally ends and violations, which the page knows before any part of the recording is loaded.

import type { ConstraintGroup, RallyEnd } from "../clip/motion";
import { CONSTRAINT_NAMES, rallyEvents, type EventFilter, type ReplayEvent, type SideNames } from "./events";
import type { SwitchedKind } from "./fragment";

/** Some violations of a side in a range of steps, inclusive. */
interface ViolationRange {
  readonly side: 0 | 1;
  readonly from: number;
  readonly to: number;
  readonly groups: readonly ConstraintGroup[];
  readonly count: number;
}

/** Rally ends and violations of a game, in order of time. */
export interface Course {
  readonly ends: readonly RallyEnd[];
  readonly violations: readonly ViolationRange[];
}

/** Kinds of events that a course does not have: they are known only of the parts that are loaded. */
export const PART_ONLY_KINDS: readonly SwitchedKind[] = ["contact", "lost", "late"];

const GROUPS = Object.keys(CONSTRAINT_NAMES) as ConstraintGroup[];

/** Parses the course in an attribute of the page; null if it is missing or not as expected. */
export function parseCourse(text: string | undefined): Course | null {
  if (text === undefined) return null;
  try {
    const { ends, violations } = JSON.parse(text) as { ends: unknown[][]; violations: unknown[][] };
    return {
      ends: ends.map(([sample, what, by, a, b]) => ({
        sample: count(sample),
        what: String(what),
        by: by === null ? null : side(by),
        score: [count(a), count(b)],
      })),
      violations: violations.map(([from, to, by, groups, number]) => ({
        from: count(from),
        to: count(to),
        side: side(by),
        groups: GROUPS.filter((group) => String(groups).split(" ").includes(group)),
        count: count(number),
      })),
    };
  } catch {
    return null;
  }
}

/** The events of a course. Contacts and what the agents saw are known only of loaded parts. */
export function courseEvents(course: Course, names: SideNames): ReplayEvent[] {
  const violations = course.violations.map((range): ReplayEvent => {
    const limits = range.groups.map((group) => CONSTRAINT_NAMES[group].name).join(", ");
    const often = range.count === 1 ? "" : ` (${range.count} times)`;
    return {
      kind: "violation",
      position: range.from,
      endPosition: range.to,
      text: `${names[range.side]}: ${limits}${often}`,
      symbol: "▲",
      side: range.side,
    };
  });
  return [...rallyEvents(course.ends, names, [0, 0]), ...violations].sort((a, b) => a.position - b.position);
}

/** Does a course have all kinds of events that are shown? */
export function courseHas(shows: EventFilter): boolean {
  return !PART_ONLY_KINDS.some((kind) => shows({ kind }));
}

/** The score at a position of the replay, in control steps. The sample of a rally's end still belongs to the rally. */
export function courseScore(course: Course, position: number): readonly [number, number] {
  return course.ends.findLast((end) => end.sample < position)?.score ?? [0, 0];
}

function count(value: unknown): number {
  if (typeof value !== "number" || !Number.isInteger(value) || value < 0) throw new Error("not a count");
  return value;
}

function side(value: unknown): 0 | 1 {
  if (value !== 0 && value !== 1) throw new Error("not a side");
  return value;
}
