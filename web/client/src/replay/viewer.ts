// The viewer: one replay on a page with its picture, and data synchronised with it. Its controls are those of a player.

import { DataTable } from "../controls/data";
import { button, h, setText } from "../controls/dom";
import { EventList } from "../controls/event-list";
import { fixed } from "../controls/format";
import { Kinematics } from "../model/kinematics";
import { newPose } from "../motion/pose";
import { StripCharts } from "../strips/strips";
import type { Caption } from "./caption";
import type { Clock } from "./clock";
import { courseEvents, courseHas, courseScore, type Course } from "./course";
import { endText, eventsOf, scoreText, type EventFilter, type ReplayEvent, type SideNames } from "./events";
import type { Layers, FrameState } from "./frame-state";
import type { FrameLoop } from "./loop";
import { paletteOf, type Palette } from "./palette";
import { Picture } from "./picture";
import { Score } from "./score";
import { nearestInParts, nearestOf } from "./search";
import { errorText, type ReplayPart, type Source } from "./source";
import { timeText, type TimeFormat } from "../controls/format";

/** Update interval of the data table during playback. */
const TABLE_UPDATE_MS = 200;

/** Parts that are fetched ahead, at most: at 16 × a part of a game lasts less than a second. */
const MAX_AHEAD = 3;

/** What a viewer needs from its page. */
export interface ViewerOptions {
  readonly section: HTMLElement;
  readonly title: string;
  readonly source: Source;
  /** Steps of a game; null for an episode, whose clip contains the number. */
  readonly steps: number | null;
  /** Names of the sides of a game. */
  readonly names: SideNames;
  /** Why the episode ended, in plain words; null if the page does not know it. */
  readonly outcome: string | null;
  /** The course of a whole game; null if the page does not know it. */
  readonly course: Course | null;
  readonly clock: Clock;
  readonly loop: FrameLoop;
  readonly layers: Layers;
  readonly format: TimeFormat;
  /** The visitor prefers reduced motion: no camera animations. */
  readonly prefersReducedMotion: boolean;
}

/** What a viewer reports to its player. */
export interface ViewerCallbacks {
  readonly announce: (text: string) => void;
  readonly clicked: () => void;
  readonly viewSwitched: () => void;
  /** Events of another part are known. */
  readonly eventsChanged: () => void;
  /** A part is shown: paths that it does not have cannot be chosen. */
  readonly partShown: (part: ReplayPart) => void;
  /** A frame was drawn; the drawing can be read until the end of the task. */
  readonly drawn: () => void;
  /** The visitor asks to open the replay again, after a failure. */
  readonly openAgain: () => void;
}

/** One replay on a page. */
export class Viewer {
  readonly element = h("div", { class: "viewer" });
  /** The picture, and the controls on it. */
  readonly screen: HTMLElement;
  /** What full screen shows. */
  readonly stage: HTMLElement;
  /** Events, charts and data. */
  readonly details = h("div", { class: "details" });
  readonly picture: Picture;
  readonly strips: StripCharts;
  /** Last step of this replay. */
  last = 0;
  /** The replay that is drawn on this one's table, too. */
  ghost: Viewer | null = null;
  /** The picture is hidden, because the replay is drawn on the table of another. */
  isGhost = false;
  private readonly currentValues = h("p", { class: "current-values" });
  private readonly problem = h("div", { class: "problem", attributes: { role: "alert", hidden: "" } });
  private readonly partEvents = new Map<number, readonly ReplayEvent[]>();
  private readonly courseEvents: readonly ReplayEvent[];
  private readonly score = new Score();
  private readonly eventList: EventList;
  private readonly dataTable: DataTable;
  private listedEvents: readonly ReplayEvent[] | null = null;
  private listedNote = "";
  private frame: FrameState | null = null;
  private isDrawRequested = false;
  private loadingIndex: number | null = null;
  private tableUpdatedMs = 0;
  private step = -1;

  constructor(
    private readonly options: ViewerOptions,
    private readonly callbacks: ViewerCallbacks,
  ) {
    const { clock, title, section, names } = options;
    this.courseEvents = options.course === null ? [] : courseEvents(options.course, names);
    this.picture = new Picture({
      title,
      names,
      prefersReducedMotion: options.prefersReducedMotion,
      changed: this.invalidate,
      switched: () => { this.viewSwitched(); },
      clicked: callbacks.clicked,
    }); // prettier-ignore
    const seek = (position: number): void => {
      clock.pause();
      clock.seek(position);
    };
    this.strips = new StripCharts(names, seek);
    this.eventList = new EventList((event) => { seek(event.position); }); // prettier-ignore
    this.dataTable = new DataTable(title);
    this.screen = h("div", { class: "screen" }, this.picture.element);
    this.stage = h("div", { class: "stage" }, this.screen, this.problem);
    this.element.append(this.stage);
    if (section.dataset.embed === undefined) {
      this.stage.append(this.currentValues);
      this.details.append(this.eventList.element, this.strips.element, this.dataTable.element);
      this.element.append(this.details);
    }
    clock.addListener(this.invalidate);
    clock.addGate((position) => this.ensureLoaded(position));
  }

  /** Loads the part at a position and replaces the still picture. False if that failed. */
  async open(position: number): Promise<boolean> {
    const { section, clock, source, steps } = this.options;
    section.dataset.state = "loading";
    const waiting = h("p", { class: "waiting", attributes: { role: "status" } }, "Loading the replay …");
    this.insertBelowStill(waiting);
    try {
      const part = await source.partAt(position);
      waiting.remove();
      this.last = steps ?? part.motion.samples - 1;
      this.mount();
      clock.extendTo(this.last);
      this.addPart(part);
      this.show(part);
      return true;
    } catch (error) {
      waiting.remove();
      section.dataset.state = "failed";
      const failure = h("div", { class: "problem", attributes: { role: "alert" } });
      failure.append(
        h("p", {}, `The replay could not be loaded: ${errorText(error)}.`),
        button("Try again", () => {
          failure.remove();
          this.callbacks.openAgain();
        }),
      );
      this.insertBelowStill(failure);
      return false;
    }
  }

  /** Events of the whole game, and of the loaded parts. */
  allEvents(): ReplayEvent[] {
    const loaded = [...this.partEvents.entries()].sort(([a], [b]) => a - b).flatMap(([, events]) => events);
    return [...this.courseEvents, ...loaded].sort((a, b) => a.position - b.position);
  }

  /** Lists the events of the kinds that are shown. */
  listEvents(shows: EventFilter): void {
    const events = this.allEvents().filter(shows);
    const isWhole = this.options.steps === null || this.isInCourse(shows);
    const note = isWhole ? "" : ", loaded parts only";
    const before = this.listedEvents;
    const isSame = before?.length === events.length && events.every((event, i) => event === before[i]);
    if (isSame && note === this.listedNote) return;
    this.listedEvents = events;
    this.listedNote = note;
    this.eventList.show(events, this.options.format, note);
    this.eventList.update(this.frame?.position ?? 0);
  }

  /** The nearest event in a direction; searches further parts of a game if necessary. */
  async findEvent(from: number, direction: 1 | -1, shows: EventFilter): Promise<ReplayEvent | null> {
    const { source } = this.options;
    const query = { from, direction, shows };
    if (this.isInCourse(shows)) return nearestOf(this.allEvents(), query);
    const load = async (index: number, start: number): Promise<void> => {
      if (!this.partEvents.has(index)) this.addPart(await source.partAt(start));
    };
    return nearestInParts(source, () => this.allEvents(), load, query);
  }

  /** Are all events of the shown kinds in the course of the game? */
  private isInCourse(shows: EventFilter): boolean {
    return this.options.course !== null && courseHas(shows);
  }

  get title(): string {
    return this.options.title;
  }

  /** How the replay ends, in words. */
  get motionEnd(): string {
    const motion = this.frame?.part.motion;
    return this.options.outcome ?? (motion === undefined ? "" : endText(motion));
  }

  /** What a saved picture shows, as text. */
  caption(): Caption {
    const { title, names, format, steps } = this.options;
    const time = `${timeText(this.step, format)} (step ${this.step})`;
    const score = steps === null ? null : this.scoreAt(this.step);
    if (this.ghost !== null) {
      const parts = [
        { text: title, colour: "rp-mallet" },
        { text: this.ghost.title, colour: "rp-ghost" },
      ] as const;
      return { parts, detail: time };
    }
    if (steps === null || score === null) return { parts: [{ text: title }], detail: time };
    return {
      parts: [
        { text: names[0], colour: "rp-mallet" },
        { text: `${score[0]} : ${score[1]}` },
        { text: names[1], colour: "rp-other-mallet" },
      ],
      detail: `${time} · ${title}`,
    };
  }

  get palette(): Palette {
    return paletteOf(this.options.section);
  }

  /** The state that is drawn; null before it is loaded. */
  get drawnFrame(): FrameState | null {
    return this.frame;
  }

  readonly invalidate = (): void => {
    if (this.isDrawRequested) return;
    this.isDrawRequested = true;
    this.options.loop.draw(this.draw);
  };

  /** Inserts an element below the still picture. */
  private insertBelowStill(element: HTMLElement): void {
    const still = this.options.section.querySelector(".still");
    if (still === null) this.options.section.prepend(element);
    else still.after(element);
  }

  private mount(): void {
    const { section } = this.options;
    const still = section.querySelector(".still");
    if (still === null) section.prepend(this.element);
    else still.replaceWith(this.element);
    section.dataset.view = this.picture.isFlat ? "flat" : "3d";
    const paint = (): void => {
      this.picture.paint(this.palette);
      this.strips.paint(this.palette);
      this.invalidate();
    };
    paint();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
  }

  /** Adds the events and scores of a loaded part. */
  private addPart(part: ReplayPart): void {
    if (this.partEvents.has(part.index)) return;
    const { course, names } = this.options;
    const events = eventsOf(part.motion, part.observed, names);
    const isInCourse = ({ kind }: ReplayEvent): boolean =>
      course !== null && (kind === "goal" || kind === "foul" || kind === "rally" || kind === "violation");
    this.partEvents.set(
      part.index,
      events.filter((event) => !isInCourse(event)),
    );
    this.score.addChunk(part.index, part.motion.rallyEnds, part.motion.score);
    this.callbacks.eventsChanged();
  }

  /** Shows a part. */
  private show(part: ReplayPart): void {
    const { section } = this.options;
    this.frame ??= {
      part,
      position: 0,
      pose: newPose(),
      arms: [new Kinematics(0), new Kinematics(1)],
      layers: this.options.layers,
      seenX: NaN,
      seenY: NaN,
      isPuckLost: false,
      ghost: null,
    };
    this.frame.part = part;
    this.strips.show(part);
    this.dataTable.show(part);
    this.callbacks.partShown(part);
    section.dataset.state = "ready";
    if (part.observationError !== null) {
      this.problem.classList.add("minor");
      this.problem.replaceChildren(
        h("p", {}, `Observations of the agent are not shown: ${part.observationError}.`),
      );
      this.problem.hidden = false;
    } else {
      this.problem.hidden = true;
    }
    this.invalidate();
  }

  /** Is the part at a position loaded? If not, starts to fetch it. */
  private ensureLoaded(position: number): boolean {
    const { source, section } = this.options;
    const clamped = Math.min(position, this.last);
    if (this.frame === null || source.loadedPartAt(clamped) !== null) return true;
    const index = source.indexOf(clamped);
    if (this.loadingIndex === index) return false;
    this.loadingIndex = index;
    section.dataset.state = "loading";
    this.picture.setTexts({
      state: "Loading …",
      outcome: "",
      isSuccess: false,
      score: this.scoreAt(clamped),
    });
    source.partAt(clamped).then(
      (part) => {
        this.addPart(part);
        if (this.loadingIndex !== index) return;
        this.loadingIndex = null;
        this.invalidate();
      },
      (error: unknown) => {
        if (this.loadingIndex !== index) return;
        this.options.clock.pause();
        section.dataset.state = "failed";
        this.picture.setTexts({ state: "Not loaded", outcome: "", isSuccess: false, score: null });
        this.problem.classList.remove("minor");
        this.problem.replaceChildren(
          h("p", {}, `This part of the replay could not be loaded: ${errorText(error)}.`),
          button("Try again", () => {
            this.loadingIndex = null;
            this.problem.hidden = true;
            this.invalidate();
          }),
        );
        this.problem.hidden = false;
      },
    );
    return false;
  }

  private readonly draw = (nowMs: number): void => {
    this.isDrawRequested = false;
    const { clock, source, section } = this.options;
    const { frame } = this;
    if (frame === null) return;
    const position = Math.min(clock.position, this.last);
    const step = Math.floor(position + 1e-6);
    if (!this.ensureLoaded(position)) return;
    this.clearProblem();
    const part = source.loadedPartAt(position);
    if (part !== null && part !== frame.part) {
      this.show(part);
      this.addPart(part);
    }
    if (clock.playing) {
      source.prefetch(position, Math.min(Math.ceil(clock.speed / 4), MAX_AHEAD));
      if (!this.picture.isFlat) this.picture.view3d?.adaptQuality(nowMs);
    }

    this.updatePose(frame, position, step);
    frame.ghost = this.ghost?.stateAt(clock.position) ?? null;
    const orbit = this.picture.view3d?.orbit;
    const moving = !this.picture.isFlat && orbit?.tick(nowMs, frame.pose) === true;
    const calls = this.isGhost ? 0 : this.picture.draw(frame);
    this.updateValues(frame, step, nowMs);
    this.callbacks.drawn();
    setData(section, "step", String(step));
    setData(section, "drawCalls", String(calls));
    section.dataset.state = "ready";
    if (moving) this.invalidate();
  };

  /** The state at a position of the clock, to draw on the table of another replay; null before it is loaded. */
  private stateAt(clockPosition: number): FrameState | null {
    const position = Math.min(clockPosition, this.last);
    if (this.frame !== null) this.updatePose(this.frame, position, Math.floor(position + 1e-6));
    return this.frame;
  }

  /** Clears an error after the visitor has moved to another part; the failed part is retried when needed again. */
  private clearProblem(): void {
    if (this.problem.hidden || this.problem.classList.contains("minor")) return;
    this.problem.hidden = true;
    this.loadingIndex = null;
  }

  private updatePose(frame: FrameState, position: number, step: number): void {
    const { interpolation, motion, observed } = frame.part;
    frame.position = position;
    interpolation.poseAt(position, frame.pose);
    for (let i = 0; i < motion.arms.length; i++)
      frame.arms[i].set(frame.pose.arms[i].q, frame.pose.arms[i].universal);
    // An observation holds until the next one.
    const k = step - motion.first;
    frame.seenX = observed?.seenX?.[k] ?? NaN;
    frame.seenY = observed?.seenY?.[k] ?? NaN;
    frame.isPuckLost = observed?.lost.some(({ from, to }) => from <= step && step <= to) === true;
  }

  private updateValues(frame: FrameState, step: number, nowMs: number): void {
    const { motion } = frame.part;
    const { x, y } = frame.pose;
    this.strips.update(frame.position);
    this.eventList.update(frame.position);
    if (!this.options.clock.playing || nowMs - this.tableUpdatedMs > TABLE_UPDATE_MS) {
      this.tableUpdatedMs = nowMs;
      this.dataTable.update(step);
    }
    // Update the numbers only once per step during playback.
    if (step === this.step && this.options.clock.playing) return;
    const k = step - motion.first;
    const speed = Math.hypot(motion.puck.vx?.[k] ?? NaN, motion.puck.vy?.[k] ?? NaN);
    const seen = frame.isPuckLost ? ", not seen by the camera" : "";
    setText(
      this.currentValues,
      `Puck at x ${fixed(x, 3)} m, y ${fixed(y, 3)} m, ${Number.isNaN(speed) ? "" : `${fixed(speed, 2)} m/s`}${seen}`,
    );
    const hasEnded = motion.end !== null && step >= motion.end.steps;
    const symbol = motion.end?.success === true ? "✓ " : motion.end?.success === false ? "✕ " : "";
    this.picture.setTexts({
      state: this.last === 0 ? "No steps" : frame.isPuckLost ? "○ Puck not seen by the camera" : "",
      outcome: hasEnded ? symbol + this.motionEnd : "",
      isSuccess: motion.end?.success === true,
      score: motion.contest === "game" ? this.scoreAt(frame.position) : null,
    });
    this.step = step;
  }

  private scoreAt(position: number): readonly [number, number] | null {
    const { course, steps } = this.options;
    if (steps === null) return null;
    return course === null ? this.score.at(position) : courseScore(course, position);
  }

  /** The score at a position as text; empty for an episode. */
  scoreTextAt(position: number): string {
    const score = this.scoreAt(position);
    return score === null ? "" : scoreText(score, this.options.names);
  }

  private viewSwitched(): void {
    const { section } = this.options;
    // Also called during the construction of the picture.
    const picture = this.picture as Picture | undefined;
    if (picture === undefined) return;
    section.dataset.view = picture.isFlat ? "flat" : "3d";
    if (this.frame !== null && picture.unavailable !== null) this.callbacks.announce(picture.unavailable);
    this.callbacks.viewSwitched();
    this.invalidate();
  }
}

/** Sets a data attribute, which tests read, if it differs. */
function setData(section: HTMLElement, name: string, value: string): void {
  if (section.dataset[name] !== value) section.dataset[name] = value;
}
