// Entry point: starts a viewer in each section with a replay on the page.

import { MODEL } from "../model/model";
import { Clock } from "./clock";
import { FrameLoop } from "./loop";
import { Source } from "./source";
import { Viewer } from "./viewer";

const loop = new FrameLoop();
const clocksByGroup = new Map<string, Clock>();
const prefersReducedMotion = matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Replays of the same group share a clock. */
function clockOf(group: string | undefined): Clock {
  const known = group === undefined ? undefined : clocksByGroup.get(group);
  const clock = known ?? new Clock(MODEL.step_s, loop);
  if (group !== undefined) clocksByGroup.set(group, clock);
  return clock;
}

for (const section of document.querySelectorAll<HTMLElement>("section[data-motion], section[data-chunks]")) {
  const { motion, observed, chunks, observedChunks, samples, title, syncGroup } = section.dataset;
  const count = chunks === undefined ? null : Number(samples ?? 1);
  const source = new Source(
    {
      motion: chunks ?? motion ?? "",
      observed: (chunks === undefined ? observed : observedChunks) ?? null,
      samples: count,
    },
    (...request) => fetch(...request),
  );
  const viewer = new Viewer({
    section,
    title: title ?? "the replay",
    source,
    steps: count === null ? null : count - 1,
    clock: clockOf(syncGroup),
    loop,
    prefersReducedMotion: prefersReducedMotion,
  });
  void viewer.open();
}
