// The fragment of an address (`#t=37&cam=side`) that links to a moment and a view of a replay.

import { SPEEDS } from "./clock";

export const CAMERAS = ["corner", "side", "robot", "above", "follow"] as const;
export type Camera = (typeof CAMERAS)[number];

/** Moment and view of a link into a replay; missing fields keep their current values. */
export interface LinkTarget {
  readonly step?: number;
  readonly camera?: Camera;
  readonly flat?: boolean;
  readonly speed?: number;
}

/** Parses `#t=37&cam=side&flat=1&speed=0.5`; unknown fields are ignored. */
export function parseFragment(fragment: string): LinkTarget {
  const fields = new URLSearchParams(fragment.replace(/^#/, ""));
  const step = Number(fields.get("t") ?? NaN);
  const camera = CAMERAS.find((name) => name === fields.get("cam"));
  const speed = SPEEDS.find((value) => value === Number(fields.get("speed")));
  return {
    ...(Number.isFinite(step) && step >= 0 ? { step } : {}),
    ...(camera === undefined ? {} : { camera }),
    ...(fields.has("flat") ? { flat: fields.get("flat") === "1" } : {}),
    ...(speed === undefined ? {} : { speed }),
  };
}

export function writeFragment(target: Required<LinkTarget>): string {
  const fields = [`t=${target.step}`];
  if (target.flat) fields.push("flat=1");
  else fields.push(`cam=${target.camera}`);
  if (target.speed !== 1) fields.push(`speed=${target.speed}`);
  return `#${fields.join("&")}`;
}
