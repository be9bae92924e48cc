// The player: the controls of one replay, or of several that share a clock.

import { Cameras } from "../controls/cameras";
import { button, h } from "../controls/dom";
import { EventKinds } from "../controls/event-kinds";
import { stepText, timeText, type TimeFormat } from "../controls/format";
import { helpDialog } from "../controls/help";
import { listenForKeys } from "../controls/keys";
import { LayerChoice } from "../controls/layers";
import { OneTable, type LegendEntry } from "../controls/one-table";
import { fullScreenButton, ShareRow } from "../controls/share";
import { Timeline } from "../controls/timeline";
import { Transport } from "../controls/transport";
import type { Clock } from "./clock";
import { parseCourse } from "./course";
import type { EventFilter, ReplayEvent, SideNames } from "./events";
import { parseFragment, writeFragment, type Camera, type LinkTarget } from "./fragment";
import type { Layers } from "./frame-state";
import type { FrameLoop } from "./loop";
import { canRecord } from "./recorder";
import { Saver } from "./saver";
import { errorText, Source, type ReplayPart } from "./source";
import { Viewer } from "./viewer";

/** What a player needs from its page. */
export interface PlayerOptions {
  readonly sections: readonly HTMLElement[];
  readonly clock: Clock;
  readonly loop: FrameLoop;
  readonly prefersReducedMotion: boolean;
}

/** Replays that share a clock, with one set of controls. */
export class Player {
  private readonly viewers: readonly Viewer[];
  private readonly layers: Layers = {
    seen: true,
    mallet: true,
    commanded: true,
    puck: true,
    wholePart: false,
  };
  private readonly format: TimeFormat;
  private readonly statusLine = h("p", { class: "sr", attributes: { role: "status" } });
  private readonly transport: Transport;
  private readonly timeline: Timeline;
  private readonly cameras: Cameras;
  private readonly layerChoice: LayerChoice;
  private readonly kinds: EventKinds;
  private readonly share: ShareRow;
  private readonly saver: Saver;
  /** Two replays can be shown on one table. */
  private readonly oneTable: OneTable | null;
  private readonly controls: HTMLElement;
  private readonly viewPanel: HTMLElement;
  private readonly viewButton: HTMLButtonElement;
  private isUpdateRequested = false;
  private wasPlaying = false;
  private shownEvents: readonly ReplayEvent[] | null = null;
  private isLinkFollowed = false;
  /** What a link says about one table, until both replays are loaded. */
  private linkedOneTable: boolean | null = null;

  constructor(private readonly options: PlayerOptions) {
    const { clock, sections } = options;
    const isGame = sections[0].dataset.chunks !== undefined;
    this.format = { stepS: clock.stepS, hasMinutes: isGame };
    this.kinds = new EventKinds(isGame, () => { this.showEvents(); }); // prettier-ignore
    const redraw = (): void => {
      for (const viewer of this.viewers) viewer.invalidate();
      this.invalidate();
    };
    this.layerChoice = new LayerChoice(this.layers, redraw);
    const help = helpDialog();
    const fullScreen = fullScreenButton(() => this.fullScreenElement);
    this.viewButton = button("View", () => { this.togglePanel(); }); // prettier-ignore
    this.viewButton.classList.add("view-button");
    this.viewButton.setAttribute("aria-expanded", "false");
    this.transport = new Transport(
      clock,
      this.format,
      {
        event: this.toEvent,
        goal: (direction) => { this.toNearest(direction, (event) => event.kind === "goal", "goal"); },
      },
      [this.viewButton, ...(fullScreen === null ? [] : [fullScreen])],
    ); // prettier-ignore
    const title = sections[0].dataset.title ?? "the replay";
    this.timeline = new Timeline(clock, this.format, (event) => { this.seek(event.position); }, title); // prettier-ignore
    this.cameras = new Cameras({
      preset: this.toCamera,
      orbit: (right, up) => { this.forEach((viewer) => viewer.picture.view3d?.orbit.turn(right, up)); },
      zoom: (steps) => { this.forEach((viewer) => viewer.picture.view3d?.orbit.zoom(steps)); },
      flat: (flat) => { this.setFlat(flat); },
    }); // prettier-ignore
    this.share = new ShareRow({
      link: () => location.href.replace(/#.*$/, "") + this.fragment(),
      save: () => {
        for (const viewer of this.drawnViewers) this.saver.savePicture(viewer);
      },
      record: canRecord() && sections.length === 1 ? () => { this.saver.toggleRecording(this.viewers[0]); } : null,
      help: () => { help.showModal(); },
      announce: this.announce,
    }); // prettier-ignore
    this.saver = new Saver({
      clock,
      step: () => this.step,
      announce: this.announce,
      failed: (reason) => { this.share.showProblem(reason); },
      recordingChanged: (isRecording) => { this.share.showRecording(isRecording); },
    }); // prettier-ignore
    this.oneTable = sections.length === 2 ? this.oneTableOf(sections[0], sections[1]) : null;
    this.controls = h("div", { class: "controls" }, this.timeline.element, this.transport.element);
    this.viewPanel = h(
      "div",
      { class: "view-panel" },
      this.oneTable?.row ?? null,
      this.cameras.element,
      this.layerChoice.element,
    );
    this.viewers = sections.map((section) => this.viewerOf(section, isGame));
    this.mount(help);
    listenForKeys((element) => this.contains(element), {
      toggle: () => { this.toggleInView(); },
      step: (by) => { clock.step(by); },
      event: this.toEvent,
      camera: this.toCamera,
      flat: () => { this.setFlat(!this.isFlat); },
      help: () => { help.showModal(); },
    }); // prettier-ignore
    clock.addListener(this.invalidate);
    addEventListener("hashchange", () => { this.follow(parseFragment(location.hash)); }); // prettier-ignore
  }

  /** Loads the replays, and goes to the moment of the page's address. */
  async open(viewers = this.viewers): Promise<void> {
    const target = parseFragment(location.hash);
    const opened = await Promise.all(viewers.map((viewer) => viewer.open(target.step ?? 0)));
    if (!opened.some(Boolean)) return;
    this.oneTable?.enable(this.viewers.every((viewer) => viewer.drawnFrame !== null));
    this.invalidate();
    this.followOneTable();
    // The others may have been moved since then when one of several replays is opened again.
    if (this.isLinkFollowed) return;
    this.isLinkFollowed = true;
    this.follow(target);
  }

  private viewerOf(section: HTMLElement, isGame: boolean): Viewer {
    const { motion, observed, chunks, observedChunks, samples, title, home, away, outcome, course } =
      section.dataset;
    const count = isGame ? Number(samples ?? 1) : null;
    const names: SideNames = [home ?? "left", away ?? "right"];
    const { clock, loop, prefersReducedMotion } = this.options;
    const { layers, format } = this;
    const source = new Source(
      {
        motion: chunks ?? motion ?? "",
        observed: (isGame ? observedChunks : observed) ?? null,
        samples: count,
      },
      (...request) => fetch(...request),
    );
    const parsedCourse = parseCourse(course);
    if (parsedCourse !== null && count !== null) this.timeline.showCourse(parsedCourse.ends, count - 1);
    const options = {
      section,
      title: title ?? "the replay",
      source,
      steps: count === null ? null : count - 1,
      names,
      outcome: outcome ?? null,
      course: parsedCourse,
      clock,
      loop,
      layers,
      format,
      prefersReducedMotion,
    };
    const viewer: Viewer = new Viewer(options, {
      announce: this.announce,
      clicked: () => { clock.toggle(); },
      viewSwitched: this.invalidate,
      eventsChanged: () => { this.showEvents(); },
      partShown: (part) => { this.offerLayers(part); },
      drawn: () => { this.drawn(viewer); },
      openAgain: () => { void this.open([viewer]); },
    }); // prettier-ignore
    return viewer;
  }

  /** Puts the controls on the only picture, or below several. */
  private mount(help: HTMLElement): void {
    const [first] = this.viewers;
    const [section] = this.options.sections;
    const isEmbedded = section.dataset.embed !== undefined;
    const rest = isEmbedded ? [] : [this.share.element];
    if (this.viewers.length === 1) {
      first.screen.append(this.controls);
      first.screen.after(this.viewPanel, ...rest);
      first.stage.append(help, this.statusLine);
      if (!isEmbedded) first.details.prepend(this.kinds.element);
      // A panel below the picture covers nothing of it.
      new ResizeObserver(() => {
        const isOverlaid = getComputedStyle(this.controls).position === "absolute";
        first.picture.setCovered(isOverlaid ? this.controls.offsetHeight : 0);
      }).observe(this.controls);
      return;
    }
    const panel = h("div", { class: "shared-controls replay" }, this.controls, this.viewPanel, ...rest);
    const details = this.viewers.map((viewer) => viewer.details);
    const pairs = h("div", { class: "side-by-side replay" }, ...details);
    panel.append(this.kinds.element, help, this.statusLine);
    const together = section.closest(".together");
    together?.append(panel);
    // At the end: what is already shown keeps its place.
    together?.parentElement?.append(pairs);
    if (this.oneTable !== null) first.screen.prepend(this.oneTable.legend);
  }

  private get fullScreenElement(): HTMLElement {
    const together = this.options.sections[0].closest<HTMLElement>(".together");
    return this.viewers.length === 1 || together === null ? this.viewers[0].stage : together;
  }

  private contains(element: Element): boolean {
    return (
      this.controls.parentElement?.contains(element) === true ||
      this.viewers.some((viewer) => viewer.element.contains(element) || viewer.details.contains(element))
    );
  }

  private forEach(change: (viewer: Viewer) => void): void {
    this.viewers.forEach(change);
  }

  private seek(position: number): void {
    this.options.clock.pause();
    this.options.clock.seek(position);
  }

  private get step(): number {
    const { clock } = this.options;
    return Math.min(Math.floor(clock.position + 1e-6), clock.last);
  }

  private get isFlat(): boolean {
    return this.viewers[0].picture.isFlat;
  }

  private oneTableOf(...sections: [HTMLElement, HTMLElement]): OneTable {
    const entryOf = ({ dataset }: HTMLElement): LegendEntry => ({
      title: dataset.title ?? "",
      outcome: dataset.outcome ?? "",
    });
    return new OneTable([entryOf(sections[0]), entryOf(sections[1])], (isOn) => {
      this.showOnOneTable(isOn);
      this.announce(isOn ? "Both replays on one table" : "Two tables");
    });
  }

  /** Draws the second replay on the table of the first, or each on its own. */
  private showOnOneTable(isOn: boolean): void {
    const [first, second] = this.viewers;
    first.ghost = isOn ? second : null;
    second.isGhost = isOn;
    this.oneTable?.show(isOn);
    this.fullScreenElement.classList.toggle("one-table", isOn);
    this.forEach((viewer) => { viewer.invalidate(); }); // prettier-ignore
  }

  /** The viewers whose pictures are shown. */
  private get drawnViewers(): readonly Viewer[] {
    return this.viewers.filter((viewer) => !viewer.isGhost);
  }

  private setFlat(flat: boolean): void {
    this.forEach((viewer) => { viewer.picture.setFlat(flat); }); // prettier-ignore
    this.announce(this.isFlat ? "Flat view" : "3-D view");
  }

  private readonly toCamera = (camera: Camera): void => {
    if (this.viewers[0].picture.unavailable !== null) return;
    if (this.isFlat) this.setFlat(false);
    this.forEach((viewer) => { viewer.picture.setCamera(camera); }); // prettier-ignore
  };

  /** Plays or pauses; a picture that is out of sight is scrolled into it before it plays. */
  private toggleInView(): void {
    const { clock } = this.options;
    const box = this.viewers[0].screen.getBoundingClientRect();
    if (!clock.playing && (box.bottom < 0 || box.top > innerHeight)) this.scrollToPicture();
    clock.toggle();
  }

  private scrollToPicture(): void {
    const target = this.viewers.length === 1 ? this.viewers[0].stage : this.fullScreenElement;
    target.scrollIntoView({ block: "start" });
  }

  /** Shows what a link names. A link to a moment plays from there, unless the visitor prefers reduced motion. */
  private follow(target: LinkTarget): void {
    const { clock, prefersReducedMotion } = this.options;
    const { step, camera, flat, ghost, speed, layers, arm, hiddenKinds } = target;
    if (camera !== undefined) this.forEach((viewer) => { viewer.picture.setCamera(camera); }); // prettier-ignore
    if (flat !== undefined) this.forEach((viewer) => { viewer.picture.setFlat(flat); }); // prettier-ignore
    if (ghost !== undefined) this.linkedOneTable = ghost;
    this.followOneTable();
    if (speed !== undefined) clock.setSpeed(speed);
    if (layers !== undefined) this.layerChoice.set(layers);
    if (arm !== undefined) this.forEach((viewer) => { viewer.strips.setArm(arm); }); // prettier-ignore
    if (hiddenKinds !== undefined) this.kinds.hide(hiddenKinds);
    if (step === undefined) return;
    this.seek(step);
    this.scrollToPicture();
    if (!prefersReducedMotion && clock.position < clock.last) clock.play();
  }

  private followOneTable(): void {
    if (this.linkedOneTable === null || this.oneTable?.isPossible !== true) return;
    this.showOnOneTable(this.linkedOneTable);
    this.linkedOneTable = null;
  }

  private fragment(): string {
    const [first] = this.viewers;
    const { camera } = first.picture;
    const hiddenKinds = this.kinds.changedKinds;
    return writeFragment({
      step: this.step,
      ...(camera === null ? {} : { camera }),
      flat: this.isFlat,
      ghost: this.oneTable?.isOn === true,
      speed: this.options.clock.speed,
      layers: this.layers,
      arm: first.strips.arm,
      ...(hiddenKinds === undefined ? {} : { hiddenKinds }),
    });
  }

  private readonly toEvent = (direction: 1 | -1): void => {
    this.toNearest(direction, this.kinds.shows, "event");
  };

  private toNearest(direction: 1 | -1, shows: EventFilter, name: string): void {
    const { clock } = this.options;
    clock.pause();
    const from = clock.position;
    Promise.all(this.viewers.map((viewer) => viewer.findEvent(from, direction, shows))).then(
      (found) => {
        // The visitor has moved on during the search.
        if (clock.position !== from) return;
        const events = found.filter((event) => event !== null);
        events.sort((a, b) => direction * (a.position - b.position));
        const event = events.at(0);
        if (event === undefined) {
          this.announce(direction === 1 ? `No later ${name}` : `No earlier ${name}`);
          return;
        }
        clock.seek(event.position);
        this.announce(`${timeText(event.position, this.format)}: ${event.text}`);
      },
      (error: unknown) => {
        this.announce(`Events could not be loaded: ${errorText(error)}`);
      },
    );
  }

  /** Shows the events of the chosen kinds on the time line and in the lists. */
  private showEvents(): void {
    // Also called during construction.
    const viewers = this.viewers as readonly Viewer[] | undefined;
    if (viewers === undefined) return;
    const all = viewers.flatMap((viewer) => viewer.allEvents()).sort((a, b) => a.position - b.position);
    this.kinds.offer(all);
    const events = all.filter(this.kinds.shows);
    const before = this.shownEvents;
    for (const viewer of viewers) viewer.listEvents(this.kinds.shows);
    if (before?.length === events.length && events.every((event, i) => event === before[i])) return;
    this.shownEvents = events;
    this.timeline.update(this.step, this.options.clock.last);
    this.timeline.show(events);
  }

  private offerLayers(part: ReplayPart): void {
    this.layerChoice.update({
      seen: part.observed !== null && part.observed.seenX !== null,
      commanded: part.paths.commanded !== null,
    });
  }

  private readonly invalidate = (): void => {
    if (this.isUpdateRequested) return;
    this.isUpdateRequested = true;
    this.options.loop.draw(this.update);
  };

  private readonly update = (): void => {
    this.isUpdateRequested = false;
    const { clock } = this.options;
    const { step } = this;
    this.transport.update(step, clock.last);
    this.timeline.update(step, clock.last);
    this.announcePlayback(step);
  };

  private drawn(viewer: Viewer): void {
    if (viewer !== this.viewers[0]) return;
    const { picture } = viewer;
    const camera = picture.view3d?.orbit.camera ?? null;
    this.cameras.update(picture.isFlat, camera, picture.unavailable === null);
    this.oneTable?.showLook(picture.isFlat);
    this.saver.addFrame(viewer);
  }

  /** Announces start and end of playback to screen readers; never changes of each frame. */
  private announcePlayback(step: number): void {
    const { clock } = this.options;
    if (clock.playing === this.wasPlaying) return;
    this.wasPlaying = clock.playing;
    const [first] = this.viewers;
    if (!clock.playing && step >= clock.last) this.saver.endRecording(first);
    if (clock.playing) this.announce("Playing");
    else if (step >= clock.last) this.announce(first.motionEnd || "End");
    else this.announce(`Paused at ${[stepText(step, clock.last, this.format), first.scoreTextAt(step)].filter(Boolean).join(", ")}`); // prettier-ignore
  }

  private readonly announce = (text: string): void => {
    this.statusLine.textContent = text;
  };

  private togglePanel(): void {
    const isOpen = this.viewPanel.classList.toggle("open");
    this.viewButton.setAttribute("aria-expanded", String(isOpen));
  }
}
