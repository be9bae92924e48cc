// The viewer: one replay on a page with all its controls.

import { Cameras } from "../controls/cameras";
import { DataTable, fileName, saveFile } from "../controls/data";
import { button, h, setText } from "../controls/dom";
import { EventList } from "../controls/event-list";
import { helpDialog } from "../controls/help";
import { listenForKeys } from "../controls/keys";
import { LayerChoice } from "../controls/layers";
import { shareRow } from "../controls/share";
import { Timeline } from "../controls/timeline";
import { Transport } from "../controls/transport";
import { fixed } from "../controls/format";
import { Kinematics } from "../model/kinematics";
import { newPose } from "../motion/pose";
import { StripCharts } from "../strips/strips";
import type { Clock } from "./clock";
import { endText, eventsOf, type ReplayEvent } from "./events";
import { parseFragment, writeFragment, type Camera } from "./fragment";
import type { FrameLoop } from "./loop";
import { paletteOf } from "./palette";
import { Score } from "./score";
import type { Layers, FrameState } from "./frame-state";
import { errorText, type ReplayPart, type Source } from "./source";
import { Picture } from "./picture";

/** Update interval of the data table during playback. */
const TABLE_UPDATE_MS = 200;

/** What a viewer needs from its page. */
export interface ViewerOptions {
  readonly section: HTMLElement;
  readonly title: string;
  readonly source: Source;
  /** Steps of a game; null for an episode, whose clip contains the number. */
  readonly steps: number | null;
  readonly clock: Clock;
  readonly loop: FrameLoop;
  /** The visitor prefers reduced motion: no camera animations. */
  readonly prefersReducedMotion: boolean;
}

/** One replay on a page: the picture, its controls, and data synchronised with it. */
export class Viewer {
  private readonly element = h("div", { class: "viewer" });
  private readonly statusLine = h("p", { class: "sr", attributes: { role: "status" } });
  private readonly currentValues = h("p", { class: "current-values" });
  private readonly problem = h("div", { class: "problem", attributes: { role: "alert", hidden: "" } });
  private readonly layers: Layers = {
    seen: true,
    mallet: true,
    commanded: true,
    puck: true,
    wholePart: false,
  };
  private readonly events = new Map<number, readonly ReplayEvent[]>();
  private readonly score = new Score();
  private readonly picture: Picture;
  private readonly transport: Transport;
  private readonly timeline: Timeline;
  private readonly cameras: Cameras;
  private readonly layerChoice: LayerChoice;
  private readonly strips: StripCharts;
  private readonly eventList: EventList;
  private readonly dataTable: DataTable;
  private frame: FrameState | null = null;
  private lastStep = 0;
  private isDrawRequested = false;
  private loadingIndex: number | null = null;
  private wasPlaying = false;
  private tableUpdatedMs = 0;
  private step = -1;

  constructor(private readonly options: ViewerOptions) {
    const { clock, title, section } = options;
    this.picture = new Picture(title, options.prefersReducedMotion, this.invalidate, () => {
      this.viewSwitched();
    });
    const seekToEvent = (event: ReplayEvent): void => {
      clock.pause();
      clock.seek(event.position);
    };
    this.transport = new Transport(clock, { event: this.toEvent });
    this.timeline = new Timeline(clock, seekToEvent, title);
    this.cameras = new Cameras({
      preset: this.toCamera,
      orbit: (right, up) => this.picture.view3d?.orbit.turn(right, up),
      zoom: (steps) => this.picture.view3d?.orbit.zoom(steps),
      flat: (flat) => {
        this.picture.setFlat(flat);
      },
    });
    this.layerChoice = new LayerChoice(this.layers, this.invalidate);
    this.strips = new StripCharts((sample) => {
      clock.pause();
      clock.seek(sample);
    });
    this.eventList = new EventList(seekToEvent);
    this.dataTable = new DataTable(title);
    const help = helpDialog();
    const share = shareRow(this.element, {
      link: () => location.href.replace(/#.*$/, "") + this.fragment(),
      save: () => void this.save(),
      help: () => { help.showModal(); },
      announce: (text) => { this.announce(text); },
    }); // prettier-ignore
    const embedded = section.dataset.embed !== undefined;
    this.element.append(
      h(
        "div",
        { class: "screen" },
        this.picture.element,
        this.timeline.element,
        this.transport.element,
        this.cameras.element,
      ),
      this.problem,
      this.statusLine,
      help,
    );
    if (!embedded) {
      this.element.append(
        this.currentValues,
        this.layerChoice.element,
        share,
        this.strips.element,
        this.eventList.element,
        this.dataTable.element,
      );
    }
    listenForKeys(this.element, {
      toggle: () => { clock.toggle(); },
      step: (by) => { clock.step(by); },
      event: this.toEvent,
      camera: this.toCamera,
      flat: () => { this.picture.setFlat(!this.picture.isFlat); },
      help: () => { help.showModal(); },
    }); // prettier-ignore
    clock.addListener(this.invalidate);
    clock.addGate((position) => this.ensureLoaded(position));
  }

  /** Loads the first part and replaces the still picture. */
  async open(): Promise<void> {
    const { section, clock, source, steps } = this.options;
    section.dataset.state = "loading";
    section.classList.add("replay");
    const waiting = h("p", { class: "waiting", attributes: { role: "status" } }, "Loading the replay …");
    this.insertBelowStill(waiting);
    const target = parseFragment(location.hash);
    try {
      const part = await source.partAt(target.step ?? 0);
      waiting.remove();
      this.lastStep = steps ?? part.motion.samples - 1;
      this.mount();
      clock.extendTo(this.lastStep);
      this.addPart(part);
      this.show(part);
      this.applyFragment();
    } catch (error) {
      waiting.remove();
      section.dataset.state = "failed";
      const failure = h("div", { class: "problem", attributes: { role: "alert" } });
      failure.append(
        h("p", {}, `The replay could not be loaded: ${errorText(error)}.`),
        button("Try again", () => {
          failure.remove();
          void this.open();
        }),
      );
      this.insertBelowStill(failure);
    }
  }

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
    this.picture.paint(paletteOf(section));
    this.strips.paint(paletteOf(section));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.picture.paint(paletteOf(section));
      this.strips.paint(paletteOf(section));
      this.invalidate();
    });
    addEventListener("hashchange", () => {
      this.applyFragment();
    });
  }

  /** Goes to the moment and view in the fragment of the address. */
  private applyFragment(): void {
    const { clock } = this.options;
    const target = parseFragment(location.hash);
    if (target.camera !== undefined) this.picture.setCamera(target.camera);
    if (target.flat !== undefined) this.picture.setFlat(target.flat);
    if (target.speed !== undefined) clock.setSpeed(target.speed);
    if (target.step !== undefined) {
      clock.pause();
      clock.seek(target.step);
    }
    this.invalidate();
  }

  private fragment(): string {
    const { clock } = this.options;
    const step = Math.min(Math.floor(clock.position + 1e-6), this.lastStep);
    return writeFragment({
      step,
      camera: this.camera() ?? "corner",
      flat: this.picture.isFlat,
      speed: clock.speed,
    });
  }

  private camera(): Camera | null {
    return this.picture.view3d?.orbit.camera ?? null;
  }

  private readonly toCamera = (camera: Camera): void => {
    if (this.picture.unavailable !== null) return;
    this.picture.setFlat(false);
    this.picture.setCamera(camera);
  };

  private readonly toEvent = (direction: 1 | -1): void => {
    const { clock } = this.options;
    clock.pause();
    const from = clock.position;
    this.findEvent(from, direction).then(
      (event) => {
        // The visitor has moved on during the search.
        if (clock.position !== from) return;
        if (event === null) {
          this.announce(direction === 1 ? "No later event" : "No earlier event");
        } else {
          clock.seek(event.position);
          this.announce(`${fixed(event.position * clock.stepS, 2)} s: ${event.text}`);
        }
      },
      (error: unknown) => {
        this.announce(`Events could not be loaded: ${errorText(error)}`);
      },
    );
  };

  /** The nearest event in a direction; searches further parts of a game if necessary. */
  private async findEvent(from: number, direction: 1 | -1): Promise<ReplayEvent | null> {
    const { source } = this.options;
    for (let index = source.indexOf(Math.min(from, this.lastStep)); ; index += direction) {
      const start = source.startOf(index);
      if (start === null) return null;
      if (!this.events.has(index)) this.addPart(await source.partAt(start));
      const events = this.events.get(index) ?? [];
      const found =
        direction === 1
          ? events.find((event) => event.position > from + 1e-4)
          : events.findLast((event) => event.position < from - 1e-4);
      if (found !== undefined) return found;
    }
  }

  private allEvents(): ReplayEvent[] {
    const chunks = [...this.events.entries()].sort(([a], [b]) => a - b);
    return chunks.flatMap(([, events]) => events);
  }

  /** Adds the events and scores of a loaded part. */
  private addPart(part: ReplayPart): void {
    if (this.events.has(part.index)) return;
    this.events.set(part.index, eventsOf(part.motion, part.observed));
    this.score.addChunk(part.index, part.motion.breaks, part.motion.score);
    const events = this.allEvents();
    const { stepS } = part.motion;
    const note = this.options.steps === null ? "" : ", loaded parts only";
    this.timeline.update(Math.max(this.step, 0), this.lastStep, stepS);
    this.timeline.show(events, stepS);
    this.eventList.show(events, stepS, note);
  }

  /** Shows a part. */
  private show(part: ReplayPart): void {
    const { section } = this.options;
    this.frame ??= {
      part,
      position: 0,
      pose: newPose(),
      arms: [new Kinematics(0), new Kinematics(1)],
      layers: this.layers,
      seenX: NaN,
      seenY: NaN,
      isPuckLost: false,
    };
    this.frame.part = part;
    this.strips.show(part);
    this.dataTable.show(part);
    this.layerChoice.update({
      seen: part.observed !== null && part.observed.seenX !== null,
      commanded: part.paths.commanded !== null,
    });
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
    const clamped = Math.min(position, this.lastStep);
    if (this.frame === null || source.loadedPartAt(clamped) !== null) return true;
    const index = source.indexOf(clamped);
    if (this.loadingIndex === index) return false;
    this.loadingIndex = index;
    section.dataset.state = "loading";
    this.picture.setTexts({ state: "Loading …", outcome: "", good: false, score: "" });
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
        this.picture.setTexts({ state: "Not loaded", outcome: "", good: false, score: "" });
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

  private readonly invalidate = (): void => {
    if (this.isDrawRequested) return;
    this.isDrawRequested = true;
    this.options.loop.draw(this.draw);
  };

  private readonly draw = (nowMs: number): void => {
    this.isDrawRequested = false;
    const { clock, source } = this.options;
    const { frame } = this;
    if (frame === null) return;
    const position = Math.min(clock.position, this.lastStep);
    const step = Math.floor(position + 1e-6);
    const { stepS } = frame.part.motion;
    this.transport.update(step, this.lastStep, stepS);
    this.timeline.update(step, this.lastStep, stepS);
    this.announcePlayback(step);
    if (!this.ensureLoaded(position)) return;
    this.clearProblem();
    const part = source.loadedPartAt(position);
    if (part !== null && part !== frame.part) {
      this.show(part);
      this.addPart(part);
    }
    if (clock.playing) {
      source.prefetch(position);
      if (!this.picture.isFlat) this.picture.view3d?.adaptQuality(nowMs);
    }

    this.updatePose(frame, position, step);
    const orbit = this.picture.view3d?.orbit;
    const moving = !this.picture.isFlat && orbit?.tick(nowMs, frame.pose) === true;
    const calls = this.picture.draw(frame);
    this.updateValues(frame, step, nowMs);
    this.cameras.update(this.picture.isFlat, this.camera(), this.picture.unavailable === null);
    const { section } = this.options;
    setData(section, "step", String(step));
    setData(section, "drawCalls", String(calls));
    section.dataset.state = "ready";
    if (moving) this.invalidate();
  };

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
    const score = motion.contest === "game" ? this.score.at(frame.position) : null;
    const symbol = motion.end?.success === true ? "✓ " : motion.end?.success === false ? "✕ " : "";
    this.picture.setTexts({
      state: this.lastStep === 0 ? "No steps" : frame.isPuckLost ? "○ Puck not seen by the camera" : "",
      outcome: hasEnded ? symbol + endText(motion) : "",
      good: motion.end?.success === true,
      score: score === null ? "" : `A ${score[0]} : ${score[1]} B`,
    });
    this.step = step;
  }

  /** Announces start and end of playback to screen readers; never changes of each frame. */
  private announcePlayback(step: number): void {
    const { clock } = this.options;
    if (clock.playing === this.wasPlaying) return;
    this.wasPlaying = clock.playing;
    const motion = this.frame?.part.motion;
    if (clock.playing) this.announce("Playing");
    else if (step >= this.lastStep && motion !== undefined) this.announce(endText(motion) || "End");
    else this.announce(`Paused at step ${step}`);
  }

  private viewSwitched(): void {
    const { section } = this.options;
    // Also called during the construction of the stage.
    const stage = this.picture as Picture | undefined;
    if (stage === undefined) return;
    section.dataset.view = stage.isFlat ? "flat" : "3d";
    if (this.frame !== null) this.announce(stage.unavailable ?? (stage.isFlat ? "Flat view" : "3-D view"));
    this.invalidate();
  }

  private announce(text: string): void {
    this.statusLine.textContent = text;
  }

  private async save(): Promise<void> {
    if (this.frame === null) return;
    const picture = await this.picture.toPng(this.frame);
    if (picture === null) this.announce("The picture could not be saved");
    else saveFile(picture, `${fileName(this.options.title, this.frame.part)}-step-${this.step}.png`);
  }
}

/** Sets a data attribute, which tests read, if it differs. */
function setData(section: HTMLElement, name: string, value: string): void {
  if (section.dataset[name] !== value) section.dataset[name] = value;
}
