// Events of a replay as text: contacts, violations, ends of rallies, lost observations and late answers.

import type { ConstraintGroup, Motion, RallyEnd, Violation } from "../clip/motion";
import type { Observed } from "../clip/observed";
import { fixed } from "../controls/format";
import type { SwitchedKind } from "./fragment";

export type EventKind = SwitchedKind | "end";

/** Names of both sides of a game. */
export type SideNames = readonly [string, string];

/** An event for the timeline and the list. */
export interface ReplayEvent {
  readonly kind: EventKind;
  /** In control steps from sample 0. */
  readonly position: number;
  /** End of the event; equal to `position` for an instant. */
  readonly endPosition: number;
  readonly text: string;
  readonly symbol: string;
  /** The side of a game to which the event belongs; null without one. */
  readonly side: 0 | 1 | null;
}

/** Which kinds of events are shown? */
export type EventFilter = (event: Pick<ReplayEvent, "kind">) => boolean;

const SYMBOLS: Record<EventKind, string> = {
  contact: "•",
  violation: "▲",
  goal: "●",
  foul: "◇",
  rally: "◆",
  lost: "○",
  late: "◷",
  end: "■",
};

/** Name, unit and factor from SI units of the violations of each group of constraints. */
export const CONSTRAINT_NAMES: Record<ConstraintGroup, { name: string; unit: string; scale: number }> = {
  ee: { name: "end effector out of bounds", unit: "mm", scale: 1000 },
  link: { name: "elbow or wrist too low", unit: "mm", scale: 1000 },
  joint_pos: { name: "joint position beyond 95 % of its range", unit: "rad", scale: 1 },
  joint_vel: { name: "joint velocity beyond 95 % of its limit", unit: "rad/s", scale: 1 },
};

/** What the puck hit, as text. */
const CONTACT_NAMES = { rim: "the rim", mallet: "the mallet", opponent_mallet: "the opponent's mallet" };

/** All events of a part in order of time. `names`: of the sides of a game. */
export function eventsOf(motion: Motion, observed: Observed | null, names: SideNames): ReplayEvent[] {
  const isGame = motion.contest === "game";
  const events: ReplayEvent[] = [];
  const add = (
    kind: EventKind,
    position: number,
    until: number,
    text: string,
    side: 0 | 1 | null = null,
    symbol = SYMBOLS[kind],
  ): void => {
    events.push({ kind, position, endPosition: until, text, symbol, side });
  };

  for (const contact of motion.contacts) {
    const position = contact.t / motion.stepS;
    const side = contact.what === "opponent_mallet" ? 1 : 0;
    const struckName =
      isGame && contact.what !== "rim" ? `the mallet of ${names[side]}` : CONTACT_NAMES[contact.what];
    add(
      "contact",
      position,
      position,
      `puck hits ${struckName} at (${fixed(contact.x, 2)}, ${fixed(contact.y, 2)}) m`,
      isGame && contact.what !== "rim" ? side : null,
    );
  }
  for (const violation of motion.violations) {
    const prefix =
      motion.arms.length > 1 && (isGame || violation.side === 1)
        ? `${sideName(motion, violation.side, names)}: `
        : "";
    const side = isGame ? violation.side : null;
    add("violation", violation.from, violation.to, prefix + violationText(violation), side);
  }
  events.push(...rallyEvents(motion.rallyEnds, names, motion.score ?? (motion.first === 0 ? [0, 0] : null)));
  for (const lost of observed?.lost ?? []) {
    add("lost", lost.from, lost.to, `camera lost the puck for ${lost.to - lost.from + 1} steps`);
  }
  for (const [from, to] of consecutiveRanges(observed?.late ?? [])) {
    const times = observed?.computationTimeS ?? null;
    let worst = 0;
    for (let k = from; k <= to; k++) worst = Math.max(worst, times?.[k - (observed?.first ?? 0)] ?? 0);
    const steps = from === to ? "answer late" : `${to - from + 1} answers late`;
    add("late", from, to, worst > 0 ? `${steps}, up to ${fixed(worst * 1000, 0)} ms` : steps);
  }
  if (motion.end !== null) {
    const { success, steps } = motion.end;
    const symbol = success === null ? SYMBOLS.end : success ? "✓" : "✕";
    add("end", steps, steps, endText(motion), null, symbol);
  }
  return events.sort((a, b) => a.position - b.position);
}

/** The ends of rallies in a row as events. `start`: the score before the first of them; null if it is not known. */
export function rallyEvents(
  ends: readonly RallyEnd[],
  names: SideNames,
  start: readonly [number, number] | null,
): ReplayEvent[] {
  let before = start;
  return ends.map((end) => {
    const { what, sample, by } = end;
    const kind = what === "goal" || what === "foul" ? what : "rally";
    const text = rallyText(end, names, before);
    before = end.score ?? before;
    return { kind, position: sample, endPosition: sample, text, symbol: SYMBOLS[kind], side: by };
  });
}

/** How the episode or game ended. */
export function endText(motion: Motion): string {
  const end = motion.end;
  if (end === null) return "";
  const why = end.why || end.end.replaceAll("_", " ");
  if (end.success === null) return `End: ${why}`;
  return `${end.success ? "Success" : "No success"}: ${why}`;
}

export function sideName(motion: Motion, side: 0 | 1, names: SideNames): string {
  if (motion.contest === "game") return names[side];
  return side === 0 ? "robot" : "opponent";
}

/** The score of a game with the names of its sides: `striker 9 : 0 keeper`. */
export function scoreText(score: readonly [number, number], names: SideNames): string {
  return `${names[0]} ${score[0]} : ${score[1]} ${names[1]}`;
}

function violationText(violation: Violation): string {
  const { name, unit, scale } = CONSTRAINT_NAMES[violation.group];
  const span =
    violation.from === violation.to ? `step ${violation.from}` : `steps ${violation.from} to ${violation.to}`;
  return `${name}, ${span}, by ${fixed(violation.worst * scale, unit === "mm" ? 1 : 3)} ${unit}`;
}

function rallyText(
  { what, by, score }: RallyEnd,
  names: SideNames,
  before: readonly [number, number] | null,
): string {
  const side = by === null ? "" : ` by ${names[by]}`;
  const texts: Record<string, string> = {
    goal: `goal${side}`,
    foul: `foul${side}: the puck stayed too long on its side${foulPoint(by, score, before, names)}`,
    stuck: "puck stuck in the middle",
    left_table: "puck left the table",
    diverged: `simulation diverged${side}`,
  };
  const shownScore = score === null ? "" : `, ${score[0]} : ${score[1]}`;
  return (texts[what] ?? what.replaceAll("_", " ") + side) + shownScore;
}

/** Why a foul changes the score, if it does. */
function foulPoint(
  by: 0 | 1 | null,
  score: readonly [number, number] | null,
  before: readonly [number, number] | null,
  names: SideNames,
): string {
  if (by === null || score === null || before === null) return "";
  const opponent = by === 0 ? 1 : 0;
  return score[opponent] > before[opponent] ? `; every third foul is a point for ${names[opponent]}` : "";
}

/** Merges consecutive numbers into ranges, first and last number inclusive. */
function consecutiveRanges(sorted: readonly number[]): [number, number][] {
  const found: [number, number][] = [];
  for (const n of [...sorted].sort((a, b) => a - b)) {
    const last = found.at(-1);
    if (last !== undefined && n <= last[1] + 1) last[1] = n;
    else found.push([n, n]);
  }
  return found;
}
