import { SPEEDS } from "./clock";

export const CAMERAS = ["corner", "side", "robot", "above"] as const;
export type Camera = (typeof CAMERAS)[number];

/** What a link to a place in a replay says; what it leaves out stays as it is. */
export interface Place {
  readonly step?: number;
  readonly camera?: Camera;
  readonly flat?: boolean;
  readonly speed?: number;
}

/** Reads `#t=37&cam=side&flat=1&speed=0.5`; what it does not know, it passes over. */
export function parseFragment(fragment: string): Place {
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

export function writeFragment(place: Required<Place>): string {
  const fields = [`t=${place.step}`];
  if (place.flat) fields.push("flat=1");
  else fields.push(`cam=${place.camera}`);
  if (place.speed !== 1) fields.push(`speed=${place.speed}`);
  return `#${fields.join("&")}`;
}
