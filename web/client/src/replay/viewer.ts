import { Cameras } from "../controls/cameras";
import { DataTable, fileName, saveFile } from "../controls/data";
import { button, h, say } from "../controls/dom";
import { EventList } from "../controls/event-list";
import { helpDialog } from "../controls/help";
import { listenForKeys } from "../controls/keys";
import { LayerChoice } from "../controls/layers";
import { shareRow } from "../controls/share";
import { Timeline } from "../controls/timeline";
import { Transport } from "../controls/transport";
import { fixed } from "../controls/words";
import { Kinematics } from "../model/kinematics";
import { newPose } from "../motion/pose";
import { Strips } from "../strips/strips";
import type { Clock } from "./clock";
import { endWords, eventsOf, type ReplayEvent } from "./events";
import { parseFragment, writeFragment, type Camera } from "./fragment";
import type { FrameLoop } from "./loop";
import { paletteOf } from "./palette";
import { Score } from "./score";
import type { Layers, Shown } from "./shown";
import { wordsOf, type Part, type Source } from "./source";
import { Stage } from "./stage";

/** While it plays, a table of figures is read by nobody more often than this. */
const FIGURES_MS = 200;

export interface Setting {
  readonly section: HTMLElement;
  readonly title: string;
  readonly source: Source;
  /** Steps of a game; null for an episode, whose clip says it. */
  readonly steps: number | null;
  readonly clock: Clock;
  readonly loop: FrameLoop;
  /** The reader wants no motion beside the replay's own. */
  readonly still: boolean;
}

/** One replay on a page: the picture, what it is steered by, and the figures in step with it. */
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
  private shown: Shown | null = null;
  private last = 0;
  private drawing = false;
  private loading: number | null = null;
  private wasPlaying = false;
  private figuresMs = 0;
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

  /** Fetches what is to be shown first, and takes the place of the still picture. */
  async open(): Promise<void> {
    const { section, clock, source, steps } = this.setting;
    section.dataset.state = "loading";
    section.classList.add("replay");
    const waiting = h("p", { class: "waiting", attributes: { role: "status" } }, "Loading the replay …");
    this.beneathStill(waiting);
    const place = parseFragment(location.hash);
    try {
      const part = await source.at(place.step ?? 0);
      waiting.remove();
      this.last = steps ?? part.motion.samples - 1;
      this.mount();
      clock.cover(this.last);
      this.learn(part);
      this.show(part);
      this.follow();
    } catch (error) {
      waiting.remove();
      section.dataset.state = "failed";
      const again = h("div", { class: "trouble", attributes: { role: "alert" } });
      again.append(
        h("p", {}, `The replay could not be loaded: ${wordsOf(error)}.`),
        button("Try again", () => {
          again.remove();
          void this.open();
        }),
      );
      this.beneathStill(again);
    }
  }

  /** Where the reader looks for the replay. */
  private beneathStill(element: HTMLElement): void {
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

  /** Goes where the address says. */
  private follow(): void {
    const { clock } = this.setting;
    const place = parseFragment(location.hash);
    if (place.camera !== undefined) this.stage.setCamera(place.camera);
    if (place.flat !== undefined) this.stage.setFlat(place.flat);
    if (place.speed !== undefined) clock.setSpeed(place.speed);
    if (place.step !== undefined) {
      clock.pause();
      clock.seek(place.step);
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
        // The reader has gone elsewhere while it was looked for.
        if (clock.position !== from) return;
        if (event === null) {
          this.announce(direction === 1 ? "No event after this" : "No event before this");
        } else {
          clock.seek(event.position);
          this.announce(`${fixed(event.position * clock.stepS, 2)} s: ${event.text}`);
        }
      },
      (error: unknown) => {
        this.announce(`Events could not be loaded: ${wordsOf(error)}`);
      },
    );
  };

  /** The nearest event in a direction, in part after part of a game until there is one. */
  private async findEvent(from: number, direction: 1 | -1): Promise<ReplayEvent | null> {
    const { source } = this.setting;
    for (let index = source.indexOf(Math.min(from, this.last)); ; index += direction) {
      const start = source.startOf(index);
      if (start === null) return null;
      if (!this.events.has(index)) this.learn(await source.at(start));
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

  /** Takes over a part that has come: its events, and how the game stood in it. */
  private learn(part: Part): void {
    if (this.events.has(part.index)) return;
    this.events.set(part.index, eventsOf(part.motion, part.observed));
    this.score.learn(part.index, part.motion.breaks, part.motion.score);
    const events = this.allEvents();
    const { stepS } = part.motion;
    const note = this.setting.steps === null ? "" : ", of the parts that were loaded";
    this.timeline.update(Math.max(this.step, 0), this.last, stepS);
    this.timeline.show(events, stepS);
    this.list.show(events, stepS, note);
  }

  /** Makes a part the one on show. */
  private show(part: Part): void {
    const { section } = this.setting;
    this.shown ??= {
      part,
      position: 0,
      pose: newPose(),
      arms: [new Kinematics(0), new Kinematics(1)],
      layers: this.layers,
      seenX: NaN,
      seenY: NaN,
      lost: false,
    };
    this.shown.part = part;
    this.strips.show(part);
    this.data.show(part);
    this.choice.update({
      seen: part.observed !== null && part.observed.seenX !== null,
      commanded: part.paths.commanded !== null,
    });
    section.dataset.state = "ready";
    if (part.unobserved !== null) {
      this.trouble.classList.add("minor");
      this.trouble.replaceChildren(h("p", {}, `What the agent observed is not shown: ${part.unobserved}.`));
      this.trouble.hidden = false;
    } else {
      this.trouble.hidden = true;
    }
    this.invalidate();
  }

  /** Whether a position can be shown; if not, fetches what is missing. */
  private ready(position: number): boolean {
    const { source, section } = this.setting;
    const at = Math.min(position, this.last);
    if (this.shown === null || source.here(at) !== null) return true;
    const index = source.indexOf(at);
    if (this.loading === index) return false;
    this.loading = index;
    section.dataset.state = "loading";
    this.stage.tell({ state: "Loading …", outcome: "", good: false, score: "" });
    source.at(at).then(
      (part) => {
        this.learn(part);
        if (this.loading !== index) return;
        this.loading = null;
        this.invalidate();
      },
      (error: unknown) => {
        if (this.loading !== index) return;
        this.setting.clock.pause();
        section.dataset.state = "failed";
        this.stage.tell({ state: "Not loaded", outcome: "", good: false, score: "" });
        this.trouble.classList.remove("minor");
        this.trouble.replaceChildren(
          h("p", {}, `This part of the replay could not be loaded: ${wordsOf(error)}.`),
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
    const { shown } = this;
    if (shown === null) return;
    const position = Math.min(clock.position, this.last);
    const step = Math.floor(position + 1e-6);
    const { stepS } = shown.part.motion;
    this.transport.update(step, this.last, stepS);
    this.timeline.update(step, this.last, stepS);
    this.tellPlaying(step);
    if (!this.ready(position)) return;
    this.recover();
    const part = source.here(position);
    if (part !== null && part !== shown.part) {
      this.show(part);
      this.learn(part);
    }
    if (clock.playing) {
      source.prefetch(position);
      if (!this.stage.flat) this.stage.solid?.pace(nowMs);
    }

    this.pose(shown, position, step);
    const orbit = this.stage.solid?.orbit;
    const moving = !this.stage.flat && orbit?.tick(nowMs) === true;
    const calls = this.stage.draw(shown);
    this.figures(shown, step, nowMs);
    this.cameras.update(this.stage.flat, this.camera(), this.stage.unavailable === null);
    const { section } = this.setting;
    mark(section, "step", String(step));
    mark(section, "drawCalls", String(calls));
    section.dataset.state = "ready";
    if (moving) this.invalidate();
  };

  /** The reader went on from a part that could not be loaded: that one is tried again when it is needed again. */
  private recover(): void {
    if (this.trouble.hidden || this.trouble.classList.contains("minor")) return;
    this.trouble.hidden = true;
    this.loading = null;
  }

  private pose(shown: Shown, position: number, step: number): void {
    const { interpolation, motion, observed } = shown.part;
    shown.position = position;
    interpolation.at(position, shown.pose);
    for (let i = 0; i < motion.arms.length; i++)
      shown.arms[i].set(shown.pose.arms[i].q, shown.pose.arms[i].universal);
    // What the agent was told holds until it is told anew.
    const k = step - motion.first;
    shown.seenX = observed?.seenX?.[k] ?? NaN;
    shown.seenY = observed?.seenY?.[k] ?? NaN;
    shown.lost = observed?.lost.some(({ from, to }) => from <= step && step <= to) === true;
  }

  private figures(shown: Shown, step: number, nowMs: number): void {
    const { motion } = shown.part;
    const { x, y } = shown.pose;
    this.strips.update(shown.position);
    this.list.update(shown.position);
    if (!this.setting.clock.playing || nowMs - this.figuresMs > FIGURES_MS) {
      this.figuresMs = nowMs;
      this.data.update(step);
    }
    // Figures that change sixty times a second are read by nobody.
    if (step === this.step && this.setting.clock.playing) return;
    const k = step - motion.first;
    const speed = Math.hypot(motion.puck.vx?.[k] ?? NaN, motion.puck.vy?.[k] ?? NaN);
    const seen = shown.lost ? ", the camera has lost it" : "";
    say(
      this.facts,
      `Puck at x ${fixed(x, 3)} m, y ${fixed(y, 3)} m, ${Number.isNaN(speed) ? "" : `${fixed(speed, 2)} m/s`}${seen}`,
    );
    const over = motion.end !== null && step >= motion.end.steps;
    const score = motion.contest === "game" ? this.score.at(shown.position) : null;
    const sign = motion.end?.success === true ? "✓ " : motion.end?.success === false ? "✕ " : "";
    this.stage.tell({
      state: this.last === 0 ? "No step was played" : shown.lost ? "○ Camera lost the puck" : "",
      outcome: over ? sign + endWords(motion) : "",
      good: motion.end?.success === true,
      score: score === null ? "" : `A ${score[0]} : ${score[1]} B`,
    });
    this.step = step;
  }

  /** Says what changed of itself; never what changes with each frame. */
  private tellPlaying(step: number): void {
    const { clock } = this.setting;
    if (clock.playing === this.wasPlaying) return;
    this.wasPlaying = clock.playing;
    const motion = this.shown?.part.motion;
    if (clock.playing) this.announce("Playing");
    else if (step >= this.last && motion !== undefined) this.announce(endWords(motion) || "End");
    else this.announce(`Paused at step ${step}`);
  }

  private viewSwitched(): void {
    const { section } = this.setting;
    // Called by the stage while it is being made, too.
    const stage = this.stage as Stage | undefined;
    if (stage === undefined) return;
    section.dataset.view = stage.flat ? "flat" : "3d";
    if (this.shown !== null) this.announce(stage.unavailable ?? (stage.flat ? "Flat view" : "3-D view"));
    this.invalidate();
  }

  private announce(text: string): void {
    this.live.textContent = text;
  }

  private async save(): Promise<void> {
    if (this.shown === null) return;
    const picture = await this.stage.picture(this.shown);
    if (picture === null) this.announce("The picture could not be made");
    else saveFile(picture, `${fileName(this.setting.title, this.shown.part)}-step-${this.step}.png`);
  }
}

function mark(section: HTMLElement, name: string, value: string): void {
  if (section.dataset[name] !== value) section.dataset[name] = value;
}
