import { ClipError } from "./error";
import type { Fields } from "./checks";
import type { Column } from "./column";
import { openContainer, type Container } from "./container";

export type Contest = "hit" | "defend" | "prepare" | "game";
export type Touched = "rim" | "mallet" | "opponent_mallet";
export type Group = "ee" | "link" | "joint_pos" | "joint_vel";

/** A contact of the puck; `t` in seconds from sample 0 of the episode or game, x and y in the table frame. */
export interface Contact {
  readonly t: number;
  readonly what: Touched;
  readonly x: number;
  readonly y: number;
}

/** A violation of a constraint at samples `from` to `to`, inclusive. */
export interface Violation {
  readonly side: 0 | 1;
  readonly group: Group;
  readonly from: number;
  readonly to: number;
  /** In rad, rad/s or m, by group. */
  readonly worst: number;
}

/** The end of a rally at `sample`; the next rally starts at the following sample. */
export interface Break {
  readonly sample: number;
  readonly what: string;
  readonly by: 0 | 1 | null;
  readonly score: readonly [number, number] | null;
}

/** The end of the episode or game. */
export interface End {
  readonly end: string;
  readonly success: boolean | null;
  readonly why: string;
  readonly steps: number;
}

/** Joints of an arm by sample, rad and rad/s; `dq` and `universal` are null if not recorded. */
export interface ArmMotion {
  readonly q: readonly Float64Array[];
  readonly dq: readonly Float64Array[] | null;
  readonly universal: readonly [Float64Array, Float64Array] | null;
}

/** Recorded motion; all arrays are indexed by sample − `first`. */
export interface Motion {
  readonly contest: Contest;
  readonly episode: number | null;
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
  /** Robot 1 (side A), and the opponent if there is one. */
  readonly arms: readonly ArmMotion[];
  readonly contacts: readonly Contact[];
  readonly violations: readonly Violation[];
  readonly breaks: readonly Break[];
  /** Score at the first sample of a game clip, if recorded. */
  readonly score: readonly [number, number] | null;
  readonly end: End | null;
  /** All decoded columns in order, for the data table. */
  readonly columns: readonly Column[];
}

const KNOWN = /^(puck_(x|y|yaw|vx|vy)|(opponent_)?(q|dq)_[1-7]|(opponent_)?universal_[12])$/;

export function decodeMotion(bytes: Uint8Array): Motion {
  const container = openContainer(bytes, (name) => KNOWN.test(name));
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
      from: v.whole("from", 0, Number.MAX_SAFE_INTEGER),
      to: v.whole("to", 0, Number.MAX_SAFE_INTEGER),
      worst: v.number("worst"),
    })),
    breaks: header.objects("breaks").map((b) => ({
      sample: b.whole("sample", 0, Number.MAX_SAFE_INTEGER),
      what: b.text("what"),
      by: b.has("by") ? sideOf(b, "by") : null,
      score: scoreOf(b),
    })),
    score: scoreOf(header),
    end: header.has("end") ? endOf(header.inside("end")) : null,
    columns: [...container.columns.values()],
  };
}

function valuesOf(container: Container, name: string): Float64Array | null {
  return container.columns.get(name)?.values ?? null;
}

/** The columns `name_1` to `name_count`; null if one is missing. */
export function family(container: Container, name: string, count: number): Float64Array[] | null {
  const found: Float64Array[] = [];
  for (let i = 1; i <= count; i++) {
    const values = valuesOf(container, `${name}_${i}`);
    if (values === null) return null;
    found.push(values);
  }
  return found;
}

function armOf(container: Container, prefix: string): ArmMotion | null {
  const q = family(container, `${prefix}q`, 7);
  if (q === null) return null;
  const universal = family(container, `${prefix}universal`, 2);
  return {
    q,
    dq: family(container, `${prefix}dq`, 7),
    universal: universal === null ? null : [universal[0], universal[1]],
  };
}

function oneOf<T extends string>(fields: Fields, name: string, known: readonly T[]): T {
  const text = fields.text(name);
  const found = known.find((word) => word === text);
  if (found === undefined) throw fields.wrong(name, `one of ${known.join(", ")}`);
  return found;
}

function sideOf(fields: Fields, name: string): 0 | 1 {
  return fields.whole(name, 0, 1) === 0 ? 0 : 1;
}

function scoreOf(fields: Fields): readonly [number, number] | null {
  const [a, b] = fields.list("score").map((entry) => entry.value);
  return typeof a === "number" && typeof b === "number" ? [a, b] : null;
}

function endOf(fields: Fields): End {
  return {
    end: fields.text("end"),
    success: fields.has("success") ? fields.flag("success") : null,
    why: fields.has("why") ? fields.text("why") : "",
    steps: fields.whole("steps", 0, Number.MAX_SAFE_INTEGER),
  };
}
