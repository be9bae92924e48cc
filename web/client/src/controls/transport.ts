// Buttons for playback, like those of a video player.

import { SPEEDS, type Clock } from "../replay/clock";
import { button, h, rename, setText } from "./dom";
import { ICONS } from "./icons";
import { timeText, type TimeFormat } from "./format";

interface Actions {
  readonly event: (direction: 1 | -1) => void;
  readonly goal: (direction: 1 | -1) => void;
}

/** Controls for playback, steps, events or goals, and speed. */
export class Transport {
  readonly element: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly pauseIcon: Element;
  private readonly playIcon: Element;
  private readonly speed: HTMLSelectElement;
  private readonly time = h("span", { class: "time" });
  private readonly step = h("span", { class: "step" });
  private playing: boolean | null = null;

  /** `extra`: buttons at the end of the row. */
  constructor(
    private readonly clock: Clock,
    private readonly format: TimeFormat,
    actions: Actions,
    extra: readonly HTMLElement[],
  ) {
    this.play = button("Play", () => { clock.toggle(); }, ICONS.play); // prettier-ignore
    this.play.classList.add("main");
    this.playIcon = this.play.children[0];
    this.pauseIcon = button("Pause", () => undefined, ICONS.pause).children[0];
    this.speed = h("select", {
      attributes: { "aria-label": "Speed" },
      on: {
        change: () => {
          clock.setSpeed(Number(this.speed.value));
        },
      },
    });
    for (const value of SPEEDS) {
      this.speed.append(h("option", { attributes: { value: String(value) } }, `${value} ×`));
    }
    const stepButton = (name: string, steps: number, iconPath: string, place = ""): HTMLButtonElement => {
      const element = button(name, () => { clock.step(steps); }, iconPath); // prettier-ignore
      if (place !== "") element.classList.add(place);
      return element;
    };
    // Only times of games have minutes.
    const isGame = format.hasMinutes;
    this.element = h(
      "div",
      { class: "row transport", attributes: { role: "group", "aria-label": "Playback" } },
      stepButton("To the start", -Infinity, ICONS.start, "to-end"),
      stepButton("One step back", -1, ICONS.back),
      this.play,
      stepButton("One step forward", 1, ICONS.forward),
      stepButton("To the end", Infinity, ICONS.end, "to-end"),
      h("span", { class: "clock" }, this.time, this.step),
      h("span", { class: "pair" },
        button(isGame ? "Previous goal" : "Previous event", () => { (isGame ? actions.goal : actions.event)(-1); }),
        button(isGame ? "Next goal" : "Next event", () => { (isGame ? actions.goal : actions.event)(1); }),
      ),
      this.speed,
      ...extra,
    ); // prettier-ignore
  }

  update(step: number, last: number): void {
    const { playing, speed } = this.clock;
    if (playing !== this.playing) {
      this.playing = playing;
      this.play.replaceChildren(playing ? this.pauseIcon : this.playIcon);
      rename(this.play, playing ? "Pause" : "Play");
    }
    const value = String(speed);
    if (this.speed.value !== value) this.speed.value = value;
    setText(this.time, `${timeText(step, this.format)} / ${timeText(last, this.format)}`);
    setText(this.step, `step ${step} of ${last}`);
  }
}
