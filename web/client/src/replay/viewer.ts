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
import { Strips } from "../strips/strips";
import type { Clock } from "./clock";
import { endText, eventsOf, type ReplayEvent } from "./events";
import { parseFragment, writeFragment, type Camera } from "./fragment";
import type { FrameLoop } from "./loop";
import { paletteOf } from "./palette";
import { Score } from "./score";
import type { Layers, FrameState } from "./frame-state";
import { errorText, type Part, type Source } from "./source";
import { Stage } from "./stage";

/** Update interval of the data table during playback. */
const TABLE_UPDATE_MS = 200;

export interface Setting {
  readonly section: HTMLElement;
  readonly title: string;
  readonly source: Source;
  /** Steps of a game; null for an episode, whose clip contains the number. */
  readonly steps: number | null;
  readonly clock: Clock;
  readonly loop: FrameLoop;
  /** The visitor prefers reduced motion: no camera animations. */
  readonly still: boolean;
}

/** One replay on a page: the picture, its controls, and data synchronised with it. */
export class Viewer {
  private readonly element = h("div", { class: "viewer" });
  private readonly live = h("p", { class: "sr", attributes: { role: "status" } });
  private readonly facts = h("p", { class: "now" });
  private readonly trouble = h("div", { class: "trouble", attributes: { role: "alert", hidden: "" } });
  private readonly layers: Layers = { seen: true, real: true, commanded: true, puck: true, whole: false };
  private readonly events = new Map<number, readonly ReplayEvent[]>();
  private readonly score = new Score();
  private readonly stage: Stage;
  private readonly transport: Transport;
  private readonly timeline: Timeline;
  private readonly cameras: Cameras;
  private readonly choice: LayerChoice;
  private readonly strips: Strips;
  private readonly list: EventList;
  private readonly data: DataTable;
  private frame: FrameState | null = null;
  private last = 0;
  private drawing = false;
  private loading: number | null = null;
  private wasPlaying = false;
  private tableUpdatedMs = 0;
  private step = -1;

  constructor(private readonly setting: Setting) {
    const { clock, title, section } = setting;
    this.stage = new Stage(title, setting.still, this.invalidate, () => {
      this.viewSwitched();
    });
    const go = (event: ReplayEvent): void => {
      clock.pause();
      clock.seek(event.position);
    };
    this.transport = new Transport(clock, { event: this.toEvent });
    this.timeline = new Timeline(clock, go, title);
    this.cameras = new Cameras({
      preset: this.toCamera,
      orbit: (right, up) => this.stage.solid?.orbit.turn(right, up),
      closer: (steps) => this.stage.solid?.orbit.closer(steps),
      flat: (flat) => {
        this.stage.setFlat(flat);
      },
    });
    this.choice = new LayerChoice(this.layers, this.invalidate);
    this.strips = new Strips((sample) => {
      clock.pause();
      clock.seek(sample);
    });
    this.list = new EventList(go);
    this.data = new DataTable(title);
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
        this.stage.element,
        this.timeline.element,
        this.transport.element,
        this.cameras.element,
      ),
      this.trouble,
      this.live,
      help,
    );
    if (!embedded) {
      this.element.append(
        this.facts,
        this.choice.element,
        share,
        this.strips.element,
        this.list.element,
        this.data.element,
      );
    }
    listenForKeys(this.element, {
      toggle: () => { clock.toggle(); },
      step: (by) => { clock.step(by); },
      event: this.toEvent,
      camera: this.toCamera,
      flat: () => { this.stage.setFlat(!this.stage.flat); },
      help: () => { help.showModal(); },
    }); // prettier-ignore
    clock.listen(this.invalidate);
    clock.gate((position) => this.ready(position));
  }

  /** Loads the first part and replaces the still picture. */
  async open(): Promise<void> {
    const { section, clock, source, steps } = this.setting;
    section.dataset.state = "loading";
    section.classList.add("replay");
    const waiting = h("p", { class: "waiting", attributes: { role: "status" } }, "Loading the replay …");
    this.insertBelowStill(waiting);
    const target = parseFragment(location.hash);
    try {
      const part = await source.at(target.step ?? 0);
      waiting.remove();
      this.last = steps ?? part.motion.samples - 1;
      this.mount();
      clock.cover(this.last);
      this.addPart(part);
      this.show(part);
      this.follow();
    } catch (error) {
      waiting.remove();
      section.dataset.state = "failed";
      const again = h("div", { class: "trouble", attributes: { role: "alert" } });
      again.append(
        h("p", {}, `The replay could not be loaded: ${errorText(error)}.`),
        button("Try again", () => {
          again.remove();
          void this.open();
        }),
      );
      this.insertBelowStill(again);
    }
  }

  /** Inserts an element below the still picture. */
  private insertBelowStill(element: HTMLElement): void {
    const still = this.setting.section.querySelector(".still");
    if (still === null) this.setting.section.prepend(element);
    else still.after(element);
  }

  private mount(): void {
    const { section } = this.setting;
    const still = section.querySelector(".still");
    if (still === null) section.prepend(this.element);
    else still.replaceWith(this.element);
    section.dataset.view = this.stage.flat ? "flat" : "3d";
    this.stage.paint(paletteOf(section));
    this.strips.paint(paletteOf(section));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.stage.paint(paletteOf(section));
      this.strips.paint(paletteOf(section));
      this.invalidate();
    });
    addEventListener("hashchange", () => {
      this.follow();
    });
  }

  /** Applies the fragment of the address. */
  private follow(): void {
    const { clock } = this.setting;
    const target = parseFragment(location.hash);
    if (target.camera !== undefined) this.stage.setCamera(target.camera);
    if (target.flat !== undefined) this.stage.setFlat(target.flat);
    if (target.speed !== undefined) clock.setSpeed(target.speed);
    if (target.step !== undefined) {
      clock.pause();
      clock.seek(target.step);
    }
    this.invalidate();
  }

  private fragment(): string {
    const { clock } = this.setting;
    const step = Math.min(Math.floor(clock.position + 1e-6), this.last);
    return writeFragment({
      step,
      camera: this.camera() ?? "corner",
      flat: this.stage.flat,
      speed: clock.speed,
    });
  }

  private camera(): Camera | null {
    return this.stage.solid?.orbit.camera ?? null;
  }

  private readonly toCamera = (camera: Camera): void => {
    if (this.stage.unavailable !== null) return;
    this.stage.setFlat(false);
    this.stage.setCamera(camera);
  };

  private readonly toEvent = (direction: 1 | -1): void => {
    const { clock } = this.setting;
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
    const { source } = this.setting;
    for (let index = source.indexOf(Math.min(from, this.last)); ; index += direction) {
      const start = source.startOf(index);
      if (start === null) return null;
      if (!this.events.has(index)) this.addPart(await source.at(start));
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
  private addPart(part: Part): void {
    if (this.events.has(part.index)) return;
    this.events.set(part.index, eventsOf(part.motion, part.observed));
    this.score.learn(part.index, part.motion.breaks, part.motion.score);
    const events = this.allEvents();
    const { stepS } = part.motion;
    const note = this.setting.steps === null ? "" : ", loaded parts only";
    this.timeline.update(Math.max(this.step, 0), this.last, stepS);
    this.timeline.show(events, stepS);
    this.list.show(events, stepS, note);
  }

  /** Shows a part. */
  private show(part: Part): void {
    const { section } = this.setting;
    this.frame ??= {
      part,
      position: 0,
      pose: newPose(),
      arms: [new Kinematics(0), new Kinematics(1)],
      layers: this.layers,
      seenX: NaN,
      seenY: NaN,
      lost: false,
    };
    this.frame.part = part;
    this.strips.show(part);
    this.data.show(part);
    this.choice.update({
      seen: part.observed !== null && part.observed.seenX !== null,
      commanded: part.paths.commanded !== null,
    });
    section.dataset.state = "ready";
    if (part.observationError !== null) {
      this.trouble.classList.add("minor");
      this.trouble.replaceChildren(
        h("p", {}, `Observations of the agent are not shown: ${part.observationError}.`),
      );
      this.trouble.hidden = false;
    } else {
      this.trouble.hidden = true;
    }
    this.invalidate();
  }

  /** Can a position be shown? If not, starts to fetch its part. */
  private ready(position: number): boolean {
    const { source, section } = this.setting;
    const at = Math.min(position, this.last);
    if (this.frame === null || source.loaded(at) !== null) return true;
    const index = source.indexOf(at);
    if (this.loading === index) return false;
    this.loading = index;
    section.dataset.state = "loading";
    this.stage.setTexts({ state: "Loading …", outcome: "", good: false, score: "" });
    source.at(at).then(
      (part) => {
        this.addPart(part);
        if (this.loading !== index) return;
        this.loading = null;
        this.invalidate();
      },
      (error: unknown) => {
        if (this.loading !== index) return;
        this.setting.clock.pause();
        section.dataset.state = "failed";
        this.stage.setTexts({ state: "Not loaded", outcome: "", good: false, score: "" });
        this.trouble.classList.remove("minor");
        this.trouble.replaceChildren(
          h("p", {}, `This part of the replay could not be loaded: ${errorText(error)}.`),
          button("Try again", () => {
            this.loading = null;
            this.trouble.hidden = true;
            this.invalidate();
          }),
        );
        this.trouble.hidden = false;
      },
    );
    return false;
  }

  private readonly invalidate = (): void => {
    if (this.drawing) return;
    this.drawing = true;
    this.setting.loop.draw(this.draw);
  };

  private readonly draw = (nowMs: number): void => {
    this.drawing = false;
    const { clock, source } = this.setting;
    const { frame } = this;
    if (frame === null) return;
    const position = Math.min(clock.position, this.last);
    const step = Math.floor(position + 1e-6);
    const { stepS } = frame.part.motion;
    this.transport.update(step, this.last, stepS);
    this.timeline.update(step, this.last, stepS);
    this.announcePlayback(step);
    if (!this.ready(position)) return;
    this.recover();
    const part = source.loaded(position);
    if (part !== null && part !== frame.part) {
      this.show(part);
      this.addPart(part);
    }
    if (clock.playing) {
      source.prefetch(position);
      if (!this.stage.flat) this.stage.solid?.adaptQuality(nowMs);
    }

    this.pose(frame, position, step);
    const orbit = this.stage.solid?.orbit;
    const moving = !this.stage.flat && orbit?.tick(nowMs) === true;
    const calls = this.stage.draw(frame);
    this.figures(frame, step, nowMs);
    this.cameras.update(this.stage.flat, this.camera(), this.stage.unavailable === null);
    const { section } = this.setting;
    mark(section, "step", String(step));
    mark(section, "drawCalls", String(calls));
    section.dataset.state = "ready";
    if (moving) this.invalidate();
  };

  /** Clears an error after the visitor has moved to another part; the failed part is retried when needed again. */
  private recover(): void {
    if (this.trouble.hidden || this.trouble.classList.contains("minor")) return;
    this.trouble.hidden = true;
    this.loading = null;
  }

  private pose(frame: FrameState, position: number, step: number): void {
    const { interpolation, motion, observed } = frame.part;
    frame.position = position;
    interpolation.at(position, frame.pose);
    for (let i = 0; i < motion.arms.length; i++)
      frame.arms[i].set(frame.pose.arms[i].q, frame.pose.arms[i].universal);
    // An observation holds until the next one.
    const k = step - motion.first;
    frame.seenX = observed?.seenX?.[k] ?? NaN;
    frame.seenY = observed?.seenY?.[k] ?? NaN;
    frame.lost = observed?.lost.some(({ from, to }) => from <= step && step <= to) === true;
  }

  private figures(frame: FrameState, step: number, nowMs: number): void {
    const { motion } = frame.part;
    const { x, y } = frame.pose;
    this.strips.update(frame.position);
    this.list.update(frame.position);
    if (!this.setting.clock.playing || nowMs - this.tableUpdatedMs > TABLE_UPDATE_MS) {
      this.tableUpdatedMs = nowMs;
      this.data.update(step);
    }
    // Update the numbers only once per step during playback.
    if (step === this.step && this.setting.clock.playing) return;
    const k = step - motion.first;
    const speed = Math.hypot(motion.puck.vx?.[k] ?? NaN, motion.puck.vy?.[k] ?? NaN);
    const seen = frame.lost ? ", not seen by the camera" : "";
    setText(
      this.facts,
      `Puck at x ${fixed(x, 3)} m, y ${fixed(y, 3)} m, ${Number.isNaN(speed) ? "" : `${fixed(speed, 2)} m/s`}${seen}`,
    );
    const over = motion.end !== null && step >= motion.end.steps;
    const score = motion.contest === "game" ? this.score.at(frame.position) : null;
    const symbol = motion.end?.success === true ? "✓ " : motion.end?.success === false ? "✕ " : "";
    this.stage.setTexts({
      state: this.last === 0 ? "No steps" : frame.lost ? "○ Puck not seen by the camera" : "",
      outcome: over ? symbol + endText(motion) : "",
      good: motion.end?.success === true,
      score: score === null ? "" : `A ${score[0]} : ${score[1]} B`,
    });
    this.step = step;
  }

  /** Announces start and end of playback to screen readers; never changes of each frame. */
  private announcePlayback(step: number): void {
    const { clock } = this.setting;
    if (clock.playing === this.wasPlaying) return;
    this.wasPlaying = clock.playing;
    const motion = this.frame?.part.motion;
    if (clock.playing) this.announce("Playing");
    else if (step >= this.last && motion !== undefined) this.announce(endText(motion) || "End");
    else this.announce(`Paused at step ${step}`);
  }

  private viewSwitched(): void {
    const { section } = this.setting;
    // Also called during the construction of the stage.
    const stage = this.stage as Stage | undefined;
    if (stage === undefined) return;
    section.dataset.view = stage.flat ? "flat" : "3d";
    if (this.frame !== null) this.announce(stage.unavailable ?? (stage.flat ? "Flat view" : "3-D view"));
    this.invalidate();
  }

  private announce(text: string): void {
    this.live.textContent = text;
  }

  private async save(): Promise<void> {
    if (this.frame === null) return;
    const picture = await this.stage.picture(this.frame);
    if (picture === null) this.announce("The picture could not be saved");
    else saveFile(picture, `${fileName(this.setting.title, this.frame.part)}-step-${this.step}.png`);
  }
}

function mark(section: HTMLElement, name: string, value: string): void {
  if (section.dataset[name] !== value) section.dataset[name] = value;
}
