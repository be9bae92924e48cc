// Search for events of a game of which some parts are loaded, and whose course is known.

import { describe, expect, it } from "vitest";
import type { EventKind, ReplayEvent } from "../src/replay/events";
import { nearestInParts } from "../src/replay/search";
import { Source } from "../src/replay/source";

function event(kind: EventKind, position: number): ReplayEvent {
  return { kind, position, endPosition: position, text: "", symbol: "", side: null };
}

/** A game of four parts with goals in its course, and contacts that only its parts have. */
class Game {
  readonly loaded: number[] = [];
  private readonly source = new Source({ motion: "", observed: null, samples: 2001 }, () =>
    Promise.reject(new Error("nothing is fetched")),
  );
  private known = [event("goal", 600), event("goal", 1700)];
  private readonly contacts = [event("contact", 1200.5), event("contact", 1900)];

  async find(from: number, direction: 1 | -1, kinds: readonly EventKind[]): Promise<number | null> {
    const shows = ({ kind }: { kind: EventKind }): boolean => kinds.includes(kind);
    const searched = { from, direction, shows };
    const found = await nearestInParts(this.source, () => this.known, this.load, searched);
    return found?.position ?? null;
  }

  readonly load = (index: number, start: number): Promise<void> => {
    expect(this.source.indexOf(start)).toBe(index);
    if (this.loaded.includes(index)) return Promise.resolve();
    this.loaded.push(index);
    const ofPart = this.contacts.filter(({ position }) => this.source.indexOf(position) === index);
    this.known = [...this.known, ...ofPart].sort((a, b) => a.position - b.position);
    return Promise.resolve();
  };
}

describe("the nearest event", () => {
  it("may be in a part that is not loaded, before a known one", async () => {
    const game = new Game();
    expect(await game.find(700, 1, ["goal", "contact"])).toBe(1200.5);
    expect(game.loaded).toEqual([1, 2]);
    expect(await new Game().find(1800, -1, ["contact"])).toBe(1200.5);
  });

  it("is a known one if the parts before it have none", async () => {
    const game = new Game();
    expect(await game.find(100, 1, ["goal", "contact"])).toBe(600);
    expect(game.loaded).toEqual([0, 1]);
    expect(await game.find(1100, -1, ["goal", "contact"])).toBe(600);
    // Further ones are known by now, but not those between.
    await game.load(3, 1500);
    expect(await game.find(700, 1, ["contact"])).toBe(1200.5);
  });

  it("is missing at both ends of the game", async () => {
    expect(await new Game().find(1900, 1, ["goal", "contact"])).toBeNull();
    expect(await new Game().find(1200, -1, ["contact"])).toBeNull();
  });
});
