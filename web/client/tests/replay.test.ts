// Clock, links, events, score, loading, CSV, keys and number formats of a replay.

import { describe, expect, it } from "vitest";
import { decodeMotion } from "../src/clip/motion";
import { decodeObserved } from "../src/clip/observed";
import { fixed, stepText, timeText } from "../src/controls/format";
import { actionFor, type KeyActions } from "../src/controls/keys";
import { Clock } from "../src/replay/clock";
import { columnName, csvOf } from "../src/replay/csv";
import { courseEvents, courseHas, courseScore, parseCourse } from "../src/replay/course";
import { endText, eventsOf, rallyEvents, scoreText } from "../src/replay/events";
import { parseFragment, writeFragment, type LinkTarget } from "../src/replay/fragment";
import { Score } from "../src/replay/score";
import { Source } from "../src/replay/source";
import { encode, stillArmColumns } from "./encoder";

/** Duration of a control step. */
const STEP_S = 0.02;

/** A frame source that tests advance manually. */
class ManualFrames {
  private waiting: ((nowMs: number) => void)[] = [];
  request(tick: (nowMs: number) => void): void {
    this.waiting.push(tick);
  }
  advanceTo(nowMs: number): void {
    const now = this.waiting;
    this.waiting = [];
    for (const tick of now) tick(nowMs);
  }
  get idle(): boolean {
    return this.waiting.length === 0;
  }
}

describe("the clock", () => {
  it("plays at its speed, stops at the end and restarts", () => {
    const frames = new ManualFrames();
    const clock = new Clock(STEP_S, frames);
    clock.extendTo(10);
    clock.setSpeed(0.5);
    clock.play();
    frames.advanceTo(1000);
    frames.advanceTo(1100);
    expect(clock.position).toBeCloseTo(2.5, 9);
    frames.advanceTo(1300);
    frames.advanceTo(1500);
    expect(clock.position).toBe(10);
    expect(clock.playing).toBe(false);
    expect(frames.idle).toBe(true);
    clock.play();
    expect(clock.position).toBe(0);
  });

  it("stops while data is missing", () => {
    const frames = new ManualFrames();
    const clock = new Clock(STEP_S, frames);
    let open = false;
    clock.extendTo(100);
    clock.addGate(() => open);
    clock.play();
    frames.advanceTo(0);
    frames.advanceTo(200);
    expect(clock.position).toBe(0);
    open = true;
    frames.advanceTo(220);
    expect(clock.position).toBeCloseTo(1, 9);
  });

  it("does not jump after the page was hidden", () => {
    const frames = new ManualFrames();
    const clock = new Clock(STEP_S, frames);
    clock.extendTo(10_000);
    clock.play();
    frames.advanceTo(0);
    frames.advanceTo(60_000);
    expect(clock.position).toBeLessThan(15);
  });

  it("moves by whole steps within the ends", () => {
    const clock = new Clock(STEP_S, new ManualFrames());
    clock.extendTo(10);
    clock.seek(3.4);
    clock.step(1);
    expect(clock.position).toBe(4);
    clock.seek(3.4);
    clock.step(-1);
    expect(clock.position).toBe(3);
    clock.step(-Infinity);
    expect(clock.position).toBe(0);
    clock.step(Infinity);
    expect(clock.position).toBe(10);
  });
});

describe("a link to a moment", () => {
  it("is parsed as written", () => {
    const target = { step: 37, camera: "side", flat: false, speed: 0.5 } as const;
    expect(writeFragment(target)).toBe("#t=37&cam=side&speed=0.5");
    expect(parseFragment(writeFragment(target))).toEqual({ step: 37, camera: "side", speed: 0.5 });
    expect(parseFragment("#t=37&flat=1")).toEqual({ step: 37, flat: true });
  });

  it("holds a turned camera, the layers, the arm and the kinds of events", () => {
    const target: LinkTarget & { step: number } = {
      step: 5,
      camera: { x: -0.27, y: 0, z: 0.08, azimuth: -1.234, elevation: 0.5, distance: 3.25 },
      layers: { puck: true, mallet: false, commanded: true, seen: false, wholePart: true },
      arm: 1,
      hiddenKinds: ["contact", "late"],
    };
    const fragment = writeFragment(target);
    expect(fragment).toBe(
      "#t=5&cam=-0.27_0_0.08_-1.234_0.5_3.25&paths=puck_commanded&trail=all&arm=2&hide=contact_late",
    );
    expect(parseFragment(fragment)).toEqual(target);
    expect(parseFragment("#t=5&ghost=1")).toEqual({ step: 5, ghost: true });
    expect(writeFragment({ step: 5, flat: true, ghost: true })).toBe("#t=5&flat=1&ghost=1");
    expect(writeFragment({ step: 5, ghost: false })).toBe("#t=5");
    const nothing = { puck: false, mallet: false, commanded: false, seen: false, wholePart: false };
    expect(parseFragment(writeFragment({ step: 0, layers: nothing, hiddenKinds: [] }))).toEqual({
      step: 0,
      layers: nothing,
      hiddenKinds: [],
    });
  });

  it("ignores unknown fields and bad values", () => {
    expect(parseFragment("#main")).toEqual({});
    expect(parseFragment("#t=-1&cam=moon&speed=3&x=%")).toEqual({});
    expect(parseFragment("#t=1e9&cam=1_2_3&paths=puck_moon&arm=3&flat=2&ghost=yes&trail=x&hide=end")).toEqual(
      {},
    );
    expect(parseFragment("#cam=9_0_0_0_0_1")).toEqual({});
    expect(parseFragment("#t=Infinity&cam=0_0_0_0_NaN_1&speed=")).toEqual({});
  });
});

const observed = encode({ kind: "observed", samples: 4, late: [2, 1], lost: [{ from: 1, to: 3 }] }, [
  { name: "computation_time", unit: "s", values: [0.004, 0.026, 0.001], first: 1, scale: 1e-6 },
]);

const motion = encode(
  {
    samples: 4,
    contacts: [{ t: 0.05, what: "rim", x: 0.31, y: -0.46 }],
    violations: [{ side: 0, group: "ee", from: 1, to: 1, worst: 0.0031 }],
    end: { end: "slow", success: true, why: "at rest behind the line", steps: 3 },
  },
  stillArmColumns(4, (k) => k * 0.1, () => 0), // prettier-ignore
);

describe("events", () => {
  it("are in order of time, with consecutive late answers merged", () => {
    const events = eventsOf(decodeMotion(motion), decodeObserved(observed), ["Alpha", "Beta"]);
    expect(events.map((event) => [event.position, event.text])).toEqual([
      [1, "end effector out of bounds, step 1, by 3.1 mm"],
      [1, "camera lost the puck for 3 steps"],
      [1, "2 answers late, up to 26 ms"],
      [2.5, "puck hits the rim at (0.31, −0.46) m"],
      [3, "Success: at rest behind the line"],
    ]);
    expect(events.at(-1)?.symbol).toBe("✓");
  });

  it("say why a third foul gives a point", () => {
    const foul = (sample: number, a: number, b: number) =>
      ({ sample, what: "foul", by: 0, score: [a, b] }) as const;
    const texts = (start: readonly [number, number] | null) =>
      rallyEvents([foul(10, 4, 0), foul(20, 4, 1)], ["Alpha", "Beta"], start).map((event) => event.text);
    const reason = "foul by Alpha: the puck stayed too long on its side";
    const point = "; every third foul is a point for Beta";
    expect(texts([4, 0])).toEqual([`${reason}, 4 : 0`, `${reason}${point}, 4 : 1`]);
    // Whether the first foul has changed the score is unknown without the score before it.
    expect(texts(null)).toEqual([`${reason}, 4 : 0`, `${reason}${point}, 4 : 1`]);
    expect(texts([3, 0])[0]).toBe(`${reason}, 4 : 0`);
  });

  it("describe the end also without a reason", () => {
    const end = { end: "left_table", success: false, why: "", steps: 1 };
    expect(endText(decodeMotion(encode({ samples: 2, end }, stillArmColumns(2, () => 0, () => 0))))).toBe(
      "No success: left table",
    ); // prettier-ignore
  });
});

describe("the score of a game", () => {
  it("follows from the last rally if no chunk is missing", () => {
    const score = new Score();
    const goal = (sample: number, a: number, b: number) =>
      ({ sample, what: "goal", by: 0, score: [a, b] }) as const;
    score.addChunk(0, [goal(100, 1, 0)], null);
    score.addChunk(2, [goal(1200, 1, 1)], null);
    expect(score.at(50)).toEqual([0, 0]);
    expect(score.at(300)).toEqual([1, 0]);
    expect(score.at(1100)).toBeNull();
    expect(score.at(1300)).toEqual([1, 1]);
    score.addChunk(1, [], null);
    expect(score.at(1100)).toEqual([1, 0]);
    expect(score.at(1500)).toEqual([1, 1]);
    score.addChunk(80, [], [4, 2]);
    expect(score.at(40_200)).toEqual([4, 2]);
  });
});

describe("the course of a game", () => {
  const names = ["striker", "keeper"] as const;
  const course = parseCourse(
    '{"ends":[[100,"goal",0,1,0],[900,"foul",1,1,0],[1200,"goal",1,1,1]],"violations":[[50,90,1,"ee joint_vel",3]]}',
  );

  it("gives events with the names of the sides, and the score", () => {
    if (course === null) throw new Error("the course is valid");
    expect(courseEvents(course, names).map(({ kind, position, text }) => [kind, position, text])).toEqual([
      [
        "violation",
        50,
        "keeper: end effector out of bounds, joint velocity beyond 95 % of its limit (3 times)",
      ],
      ["goal", 100, "goal by striker, 1 : 0"],
      ["foul", 900, "foul by keeper: the puck stayed too long on its side, 1 : 0"],
      ["goal", 1200, "goal by keeper, 1 : 1"],
    ]);
    expect([100, 101, 1200, 1201].map((position) => scoreText(courseScore(course, position), names))).toEqual(
      ["striker 0 : 0 keeper", "striker 1 : 0 keeper", "striker 1 : 0 keeper", "striker 1 : 1 keeper"],
    );
  });

  it("has no contacts, lost pucks and late answers", () => {
    const hidden = (...kinds: string[]) => courseHas(({ kind }) => !kinds.includes(kind));
    expect(hidden("contact", "lost", "late")).toBe(true);
    expect(hidden("contact", "lost", "late", "goal")).toBe(true);
    expect(hidden("contact", "lost")).toBe(false);
    expect(hidden("goal", "foul", "rally", "violation")).toBe(false);
  });

  it("is unknown if the page does not have it as expected", () => {
    for (const text of [undefined, "", "null", '{"ends":[]}', '{"ends":[[1,"goal",2,0,0]],"violations":[]}'])
      expect(parseCourse(text)).toBeNull();
  });
});

describe("a source", () => {
  /** A clip of a chunk of a game in which nothing moves. */
  const chunk = (first: number): Uint8Array<ArrayBuffer> =>
    encode({ contest: "game", first, samples: 501 }, stillArmColumns(501, () => 0, () => 0)); // prettier-ignore

  it("fetches a chunk once, caches a few, and works without observations", async () => {
    const asked: string[] = [];
    const source = new Source({ motion: "/m/{chunk}", observed: "/o/{chunk}", samples: 5001 }, (address) => {
      const path = address as string;
      asked.push(path);
      const found = path.startsWith("/m/") ? new Response(chunk(500 * Number(path.slice(3)))) : null;
      return Promise.resolve(found ?? new Response(null, { status: 403 }));
    });
    const [part, same] = await Promise.all([source.partAt(700), source.partAt(999.9)]);
    expect(part).toBe(same);
    expect(part.motion.first).toBe(500);
    expect(part.observationError).toMatch(/access denied/);
    expect(asked).toEqual(["/m/1", "/o/1"]);
    expect(source.indexOf(5000)).toBe(9);
    for (const position of [1000, 1500, 2000, 2500, 3000, 3500]) await source.partAt(position);
    expect(source.loadedPartAt(700)).toBeNull();
    expect(source.loadedPartAt(3999)?.motion.first).toBe(3500);
  });

  it("reports the status and can retry", async () => {
    let status = 500;
    const source = new Source({ motion: "/m", observed: null, samples: null }, () =>
      Promise.resolve(status === 200 ? new Response(motion) : new Response(null, { status })),
    );
    await expect(source.partAt(0)).rejects.toThrow("the server answered with status 500");
    status = 404;
    await expect(source.partAt(0)).rejects.toThrow("no recording");
    status = 200;
    await expect(source.partAt(0)).resolves.toMatchObject({ index: 0 });
  });

  it("exports CSV with units", async () => {
    const source = new Source({ motion: "/m", observed: "/o", samples: null }, (address) =>
      Promise.resolve(new Response(address === "/m" ? motion : observed)),
    );
    const lines = csvOf(await source.partAt(0)).split("\n");
    expect(lines[0]).toBe("sample,time_s,puck_x,puck_y,q_1,q_2,q_3,q_4,q_5,q_6,q_7,computation_time_s");
    expect(lines[1]).toBe("0,0,0,0,0,0.1,0.2,0.3,0.4,0.5,0.6,");
    expect(lines[3]).toBe("2,0.04,0.2,0,0,0.1,0.2,0.3,0.4,0.5,0.6,0.026");
    expect(columnName({ name: "dq_1", unit: "rad/s", values: new Float64Array() })).toBe("dq_1_rad_s");
  });
});

describe("keys", () => {
  const nothing = (): void => undefined;
  const actions: KeyActions = {
    toggle: nothing,
    step: nothing,
    event: nothing,
    camera: nothing,
    flat: nothing,
    help: nothing,
  };

  it("are left to a control that needs them", () => {
    expect(actionFor(" ", false, "picture", actions)).toBe(actions.toggle);
    expect(actionFor(" ", false, "button", actions)).toBeNull();
    expect(actionFor("ArrowLeft", false, "slider", actions)).toBeNull();
    expect(actionFor("ArrowLeft", true, "slider", actions)).not.toBeNull();
    expect(actionFor("n", false, "other", actions)).toBeNull();
    expect(actionFor(" ", false, "other", actions)).toBeNull();
    expect(actionFor("Tab", false, "picture", actions)).toBeNull();
  });

  it("are left to the page outside the replay, except for the space key", () => {
    expect(actionFor(" ", false, "page", actions)).toBe(actions.toggle);
    expect(actionFor(" ", true, "page", actions)).toBeNull();
    for (const key of ["n", "f", "1", "ArrowLeft", "Home", "?"])
      expect(actionFor(key, false, "page", actions)).toBeNull();
  });
});

describe("number formats", () => {
  it("use a true minus, and no sign for zero", () => {
    expect(fixed(-0.0004, 2)).toBe("0.00");
    expect(fixed(-1.5, 1)).toBe("−1.5");
    expect(stepText(37, 120, { stepS: STEP_S, hasMinutes: false })).toBe("step 37 of 120, 0.74 s");
  });

  it("write times of games in minutes and seconds", () => {
    const game = { stepS: STEP_S, hasMinutes: true };
    expect([0, 49, 50, 22_400, 45_000].map((step) => timeText(step, game))).toEqual([
      "0:00",
      "0:00",
      "0:01",
      "7:28",
      "15:00",
    ]);
    expect(stepText(22_400, 45_000, game)).toBe("7:28 of 15:00");
  });
});
