import { MODEL } from "../model/model";
import { Clock } from "./clock";
import { FrameLoop } from "./loop";
import { Source } from "./source";
import { Viewer } from "./viewer";

const loop = new FrameLoop();
const together = new Map<string, Clock>();
const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Replays of the same group share a clock. */
function clockOf(name: string | undefined): Clock {
  const known = name === undefined ? undefined : together.get(name);
  const clock = known ?? new Clock(MODEL.step_s, loop);
  if (name !== undefined) together.set(name, clock);
  return clock;
}

for (const section of document.querySelectorAll<HTMLElement>("section[data-motion], section[data-chunks]")) {
  const { motion, observed, chunks, observedChunks, samples, title, together: name } = section.dataset;
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
    clock: clockOf(name),
    loop,
    still,
  });
  void viewer.open();
}
