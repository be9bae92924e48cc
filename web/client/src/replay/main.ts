// Entry point: starts a player for the replays of a page.

import { MODEL } from "../model/model";
import { Clock } from "./clock";
import { FrameLoop } from "./loop";
import { Player } from "./player";

const loop = new FrameLoop();
const prefersReducedMotion = matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Replays of the same group share a player. */
const groups = new Map<string, HTMLElement[]>();
for (const section of document.querySelectorAll<HTMLElement>("section[data-motion], section[data-chunks]")) {
  const group = section.dataset.syncGroup ?? section.id;
  groups.set(group, [...(groups.get(group) ?? []), section]);
}

for (const sections of groups.values()) {
  const clock = new Clock(MODEL.step_s, loop);
  void new Player({ sections, clock, loop, prefersReducedMotion }).open();
}
