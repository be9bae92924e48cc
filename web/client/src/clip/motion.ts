// The motion clip: recorded motion of puck and arms, with contacts, violations and ends of rallies. Visible to everyone.

import { ClipError } from "./error";
import type { Fields } from "./checks";
import type { Column } from "./column";
import { openContainer, type Container } from "./container";

/** The kind of recording: an episode of a task, or a game. */
export type Contest = "hit" | "defend" | "prepare" | "game";
/** What the puck touched. */
export type ContactKind = "rim" | "mallet" | "opponent_mallet";
/** Groups of constraints: end effector, elbow and wrist, joint positions, joint velocities. */
export type ConstraintGroup = "ee" | "link" | "joint_pos" | "joint_vel";

/** A contact of the puck; `t` in seconds from sample 0 of the episode or game, x and y in the table frame. */
export interface Contact {
  readonly t: number;
  readonly what: ContactKind;
  readonly x: number;
  readonly y: number;
}

/** A violation of a constraint at samples `from` to `to`, inclusive. */
export interface Violation {
  readonly side: 0 | 1;
  readonly group: ConstraintGroup;
  readonly from: number;
  readonly to: number;
  /** Largest excess over the limit, in rad, rad/s or m, by group. */
  readonly worst: number;
}

/** The end of a rally at `sample`; the next rally starts at the following sample. */
export interface RallyEnd {
  readonly sample: number;
  readonly what: string;
  /** The side that scored or fouled. */
  readonly by: 0 | 1 | null;
  /** Score after the rally. */
  readonly score: readonly [number, number] | null;
}

/** The end of the episode or game. */
export interface EpisodeEnd {
  /** How it ended, as an identifier such as `left_table`. */
  readonly end: string;
  readonly success: boolean | null;
  /** Why it ended, as text. */
  readonly why: string;
  readonly steps: number;
}

/**
 * Joints of an arm by sample, rad and rad/s: angles `q`, velocities `dq`, and angles of the universal joint of the mallet; null if
 * not recorded.
 */
export interface ArmMotion {
  readonly q: readonly Float64Array[];
  readonly dq: readonly Float64Array[] | null;
  readonly universal: readonly [Float64Array, Float64Array] | null;
}

/** Recorded motion; all arrays are indexed by sample − `first`. */
export interface Motion {
  readonly contest: Contest;
  readonly episode: number | null;
  /** Index of the first sample in the episode or game. */
  readonly first: number;
  readonly samples: number;
  readonly stepS: number;
  readonly puck: {
    readonly x: Float64Array;
    readonly y: Float64Array;
    readonly yaw: Float64Array | null;
    readonly vx: Float64Array | null;
    readonly vy: Float64Array | null;
  };
  /** Robot 1 (side 0), and robot 2, the opponent (side 1), if there is one. */
  readonly arms: readonly ArmMotion[];
  readonly contacts: readonly Contact[];
  readonly violations: readonly Violation[];
  readonly rallyEnds: readonly RallyEnd[];
  /** Score at the first sample of a game clip, if recorded. */
  readonly score: readonly [number, number] | null;
  readonly end: EpisodeEnd | null;
  /** All decoded columns in order, for the data table. */
  readonly columns: readonly Column[];
}

/** Names of the columns that are decoded. */
const MOTION_COLUMNS = /^(puck_(x|y|yaw|vx|vy)|(opponent_)?(q|dq)_[1-7]|(opponent_)?universal_[12])$/;

export function decodeMotion(bytes: Uint8Array): Motion {
  const container = openContainer(bytes, (name) => MOTION_COLUMNS.test(name));
  if (container.kind !== "motion") {
    throw new ClipError(`expected a clip of kind "motion", got "${container.kind}"`);
  }
  const x = valuesOf(container, "puck_x");
  const y = valuesOf(container, "puck_y");
  const own = armOf(container, "");
  if (x === null || y === null || own === null) {
    throw new ClipError("the clip has no puck position or no joints: there is nothing to draw");
  }
  const opponent = armOf(container, "opponent_");
  const { header } = container;
  return {
    contest: oneOf(header, "contest", ["hit", "defend", "prepare", "game"]),
    episode: container.episode,
    first: container.first,
    samples: container.samples,
    stepS: container.stepS,
    puck: {
      x,
      y,
      yaw: valuesOf(container, "puck_yaw"),
      vx: valuesOf(container, "puck_vx"),
      vy: valuesOf(container, "puck_vy"),
    },
    arms: opponent === null ? [own] : [own, opponent],
    contacts: header
      .objects("contacts")
      .map((c) => ({
        t: c.number("t"),
        what: oneOf(c, "what", ["rim", "mallet", "opponent_mallet"] as const),
        x: c.number("x"),
        y: c.number("y"),
      }))
      .sort((a, b) => a.t - b.t),
    violations: header.objects("violations").map((v) => ({
      side: sideOf(v, "side"),
      group: oneOf(v, "group", ["ee", "link", "joint_pos", "joint_vel"] as const),
      from: v.integer("from", 0, Number.MAX_SAFE_INTEGER),
      to: v.integer("to", 0, Number.MAX_SAFE_INTEGER),
      worst: v.number("worst"),
    })),
    rallyEnds: header.objects("breaks").map((b) => ({
      sample: b.integer("sample", 0, Number.MAX_SAFE_INTEGER),
      what: b.text("what"),
      by: b.has("by") ? sideOf(b, "by") : null,
      score: scoreOf(b),
    })),
    score: scoreOf(header),
    end: header.has("end") ? endOf(header.object("end")) : null,
    columns: [...container.columns.values()],
  };
}

function valuesOf(container: Container, name: string): Float64Array | null {
  return container.columns.get(name)?.values ?? null;
}

/** The columns `name_1` to `name_count`; null if one is missing. */
export function numberedColumns(container: Container, name: string, count: number): Float64Array[] | null {
  const found: Float64Array[] = [];
  for (let i = 1; i <= count; i++) {
    const values = valuesOf(container, `${name}_${i}`);
    if (values === null) return null;
    found.push(values);
  }
  return found;
}

function armOf(container: Container, prefix: string): ArmMotion | null {
  const q = numberedColumns(container, `${prefix}q`, 7);
  if (q === null) return null;
  const universal = numberedColumns(container, `${prefix}universal`, 2);
  return {
    q,
    dq: numberedColumns(container, `${prefix}dq`, 7),
    universal: universal === null ? null : [universal[0], universal[1]],
  };
}

function oneOf<T extends string>(fields: Fields, name: string, known: readonly T[]): T {
  const text = fields.text(name);
  const found = known.find((word) => word === text);
  if (found === undefined) throw fields.typeError(name, `one of ${known.join(", ")}`);
  return found;
}

function sideOf(fields: Fields, name: string): 0 | 1 {
  return fields.integer(name, 0, 1) === 0 ? 0 : 1;
}

function scoreOf(fields: Fields): readonly [number, number] | null {
  const [a, b] = fields.list("score").map((entry) => entry.value);
  return typeof a === "number" && typeof b === "number" ? [a, b] : null;
}

function endOf(fields: Fields): EpisodeEnd {
  return {
    end: fields.text("end"),
    success: fields.has("success") ? fields.boolean("success") : null,
    why: fields.has("why") ? fields.text("why") : "",
    steps: fields.integer("steps", 0, Number.MAX_SAFE_INTEGER),
  };
}
