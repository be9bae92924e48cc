// The fragment of an address (`#t=37&cam=side`) that links to a moment and a view of a replay.

import { SPEEDS } from "./clock";
import type { Layers } from "./frame-state";

export const CAMERAS = ["corner", "side", "robot", "above", "follow"] as const;
export type Camera = (typeof CAMERAS)[number];

/** A camera that the visitor turned: the point x, y, z (m) that it looks at, its angles (rad) and distance (m) from there. */
export interface CameraPosition {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly azimuth: number;
  readonly elevation: number;
  readonly distance: number;
}

/** Kinds of events that the visitor can switch off. */
export const EVENT_KINDS = ["goal", "foul", "rally", "violation", "contact", "lost", "late"] as const;
export type SwitchedKind = (typeof EVENT_KINDS)[number];

/** Moment and view of a link into a replay; missing fields keep their current values. */
export interface LinkTarget {
  readonly step?: number;
  readonly camera?: Camera | CameraPosition;
  readonly flat?: boolean;
  /** Is the second of two replays drawn on the table of the first? */
  readonly ghost?: boolean;
  readonly speed?: number;
  readonly layers?: Layers;
  /** The arm whose values are shown. */
  readonly arm?: 0 | 1;
  /** Kinds of events that are switched off. */
  readonly hiddenKinds?: readonly SwitchedKind[];
}

/** Names of the layers in a link; of the agent's data, `commanded` is the path of the mallet, and `seen` the observed puck. */
const PATHS = ["puck", "mallet", "commanded", "seen"] as const;

/** Parses `#t=37&cam=side&flat=1&speed=0.5`; unknown fields and bad values are ignored. */
export function parseFragment(fragment: string): LinkTarget {
  const fields = new URLSearchParams(fragment.replace(/^#/, ""));
  const step = parseNumber(fields.get("t"));
  const camera = parseCamera(fields.get("cam") ?? "");
  const speed = SPEEDS.find((value) => value === parseNumber(fields.get("speed")));
  const flat = fields.get("flat");
  const arm = fields.get("arm");
  const ghost = fields.get("ghost");
  const layers = parseLayers(fields.get("paths"), fields.get("trail"));
  const hidden = parseNames(fields.get("hide"), EVENT_KINDS);
  return {
    ...(step !== null && step >= 0 ? { step } : {}),
    ...(camera === null ? {} : { camera }),
    ...(flat === "0" || flat === "1" ? { flat: flat === "1" } : {}),
    ...(ghost === "0" || ghost === "1" ? { ghost: ghost === "1" } : {}),
    ...(speed === undefined ? {} : { speed }),
    ...(layers === null ? {} : { layers }),
    ...(arm === "1" || arm === "2" ? { arm: arm === "1" ? 0 : 1 } : {}),
    ...(hidden === null ? {} : { hiddenKinds: hidden }),
  };
}

export function writeFragment(target: LinkTarget & { readonly step: number }): string {
  const { step, camera, flat, ghost, speed, layers, arm, hiddenKinds } = target;
  const fields = [`t=${step}`];
  if (flat === true) fields.push("flat=1");
  if (typeof camera === "string" && flat !== true) fields.push(`cam=${camera}`);
  if (typeof camera === "object") {
    const { x, y, z, azimuth, elevation, distance } = camera;
    fields.push(`cam=${[x, y, z, azimuth, elevation, distance].map((value) => Number(value.toFixed(3))).join("_")}`);
  } // prettier-ignore
  if (ghost === true) fields.push("ghost=1");
  if (speed !== undefined && speed !== 1) fields.push(`speed=${speed}`);
  if (layers !== undefined) {
    const shown = PATHS.filter((name) => layers[name]);
    if (shown.length < PATHS.length) fields.push(`paths=${shown.join("_") || "none"}`);
    if (layers.wholePart) fields.push("trail=all");
  }
  if (arm === 1) fields.push("arm=2");
  if (hiddenKinds !== undefined) fields.push(`hide=${hiddenKinds.join("_") || "none"}`);
  return `#${fields.join("&")}`;
}

function parseNumber(text: string | null): number | null {
  if (text === null || !/^-?\d{1,9}(\.\d{1,9})?$/.test(text)) return null;
  return Number(text);
}

function parseCamera(text: string): Camera | CameraPosition | null {
  const preset = CAMERAS.find((name) => name === text);
  if (preset !== undefined) return preset;
  const values = text.split("_").map(parseNumber);
  const [x, y, z, azimuth, elevation, distance] = values;
  if (values.length !== 6) return null;
  if (x === null || y === null || z === null) return null;
  if (azimuth === null || elevation === null || distance === null) return null;
  // The table is 2 m long: a point far from it is a foreign value.
  if (Math.max(Math.abs(x), Math.abs(y), Math.abs(z)) > 2 || Math.abs(azimuth) > 100) return null;
  return { x, y, z, azimuth, elevation, distance };
}

/** Layers of a link; a link without these fields keeps the current ones. */
function parseLayers(paths: string | null, trail: string | null): Layers | null {
  const shown = parseNames(paths, PATHS);
  if (shown === null && trail !== "all" && trail !== "second") return null;
  const isShown = (name: (typeof PATHS)[number]): boolean => shown === null || shown.includes(name);
  return {
    puck: isShown("puck"),
    mallet: isShown("mallet"),
    commanded: isShown("commanded"),
    seen: isShown("seen"),
    wholePart: trail === "all",
  };
}

/** Known names of a list such as `a_b`; null if it is missing or has an unknown name. */
function parseNames<T extends string>(text: string | null, known: readonly T[]): readonly T[] | null {
  if (text === null) return null;
  if (text === "none") return [];
  const names = text.split("_").map((part) => known.find((name) => name === part));
  const found = names.filter((name) => name !== undefined);
  return found.length === names.length ? found : null;
}
