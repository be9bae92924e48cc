// The timeline: a slider for the time, with a mark for each event.

import type { RallyEnd } from "../clip/motion";
import type { Clock } from "../replay/clock";
import type { ReplayEvent } from "../replay/events";
import { drawing, h, setText } from "./dom";
import { stepText, timeText, type TimeFormat } from "./format";

/** Largest number of marks of one kind that are buttons; more would overlap, so they are bars. The list has all events. */
const MAX_BUTTONS_OF_KIND = 60;

/** The slider with a mark per event above it. */
export class Timeline {
  readonly element: HTMLElement;
  private readonly slider = h("input", {
    class: "slider",
    attributes: { type: "range", min: "0", step: "1" },
  });
  private readonly marks = h("div", {
    class: "marks",
    attributes: { role: "group", "aria-label": "Events on the timeline" },
  });
  private readonly tooltip = h("span", { class: "tooltip", attributes: { hidden: "" } });
  private events: readonly ReplayEvent[] = [];
  private buttons: HTMLButtonElement[] = [];
  /** The score of each side over the time of a game. */
  private readonly course = h("div", { class: "course-lines", attributes: { hidden: "" } });
  private last = -1;
  private step = -1;

  constructor(
    clock: Clock,
    private readonly format: TimeFormat,
    private readonly seekToEvent: (event: ReplayEvent) => void,
    title: string,
  ) {
    this.slider.setAttribute("aria-label", `Time of ${title}`);
    this.slider.addEventListener("input", () => {
      clock.pause();
      clock.seek(Number(this.slider.value));
    });
    // Arrow keys move between marks, so that all marks are a single tab stop.
    this.marks.addEventListener("keydown", (event) => {
      const direction = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      const from = this.buttons.findIndex((mark) => mark === document.activeElement);
      if (direction === 0 || from < 0) return;
      event.preventDefault();
      event.stopPropagation();
      const next = this.buttons[Math.min(Math.max(from + direction, 0), this.buttons.length - 1)];
      this.buttons[from].tabIndex = -1;
      next.tabIndex = 0;
      next.focus();
    });
    this.element = h("div", { class: "timeline" }, this.course, this.marks, this.slider);
  }

  update(step: number, last: number): void {
    if (last !== this.last) {
      this.last = last;
      this.slider.max = String(last);
      this.placeMarks();
    }
    if (step !== this.step) {
      this.step = step;
      this.slider.value = String(step);
      this.slider.setAttribute("aria-valuetext", stepText(step, last, this.format));
    }
  }

  show(events: readonly ReplayEvent[]): void {
    this.events = events;
    this.placeMarks();
  }

  /** Shows the course of the score of a game that ends at step `last`. */
  showCourse(ends: readonly RallyEnd[], last: number): void {
    const scores = ends.flatMap(({ sample, score }) => (score === null ? [] : [{ sample, score }]));
    const highest = Math.max(1, ...scores.flatMap(({ score }) => score));
    this.course.hidden = false;
    // In pixels: a drawing that is stretched would have lines of different widths.
    new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = this.course;
      if (width === 0) return;
      const lines = ([0, 1] as const).map((side) => {
        const steps = scores.map(({ sample, score }) => {
          const y = height * (1 - score[side] / highest);
          return `H${((sample / last) * width).toFixed(1)}V${y.toFixed(1)}`;
        });
        return { d: `M0 ${height}${steps.join("")}H${width}`, class: `side-${side + 1}` };
      });
      this.course.replaceChildren(drawing(`0 0 ${width} ${height}`, lines));
    }).observe(this.course);
  }

  private placeMarks(): void {
    if (this.last <= 0) return;
    // `position`: in control steps, may be fractional.
    const share = (position: number): string =>
      `${(100 * Math.min(Math.max(position / this.last, 0), 1)).toFixed(3)}%`;
    const countByKind = new Map<string, number>();
    for (const { kind } of this.events) countByKind.set(kind, (countByKind.get(kind) ?? 0) + 1);
    const spans: HTMLElement[] = [];
    this.buttons = [];
    for (const event of this.events) {
      const isBar = (countByKind.get(event.kind) ?? 0) > MAX_BUTTONS_OF_KIND;
      if (isBar || event.endPosition > event.position) {
        const span = h("span", { class: `span ${event.kind}` });
        span.style.left = share(event.position);
        span.style.width = share(event.endPosition - event.position);
        spans.push(span);
      }
      if (isBar) continue;
      const label = `${timeText(event.position, this.format)}: ${event.text}`;
      const side = event.side === null ? "" : ` side-${event.side + 1}`;
      const mark = h(
        "button",
        {
          class: `mark ${event.kind}${side}`,
          attributes: { type: "button", tabindex: this.buttons.length === 0 ? "0" : "-1", "aria-label": label },
          on: {
            click: () => {
              this.seekToEvent(event);
            },
            pointerenter: () => { this.showTooltip(label, event.position); },
            focus: () => { this.showTooltip(label, event.position); },
            pointerleave: () => { this.tooltip.hidden = true; },
            blur: () => { this.tooltip.hidden = true; },
          },
        },
        event.symbol,
      ); // prettier-ignore
      mark.style.left = share(event.position);
      this.buttons.push(mark);
    }
    this.marks.replaceChildren(...spans, ...this.buttons, this.tooltip);
    this.marks.hidden = this.buttons.length + spans.length === 0;
  }

  /** Shows the tip above its mark, inside the width of the picture. */
  private showTooltip(label: string, position: number): void {
    setText(this.tooltip, label);
    this.tooltip.hidden = false;
    const width = this.marks.clientWidth;
    const half = this.tooltip.offsetWidth / 2;
    const centre = Math.min(Math.max((position / this.last) * width, half), Math.max(width - half, half));
    this.tooltip.style.left = `${centre - half}px`;
  }
}
