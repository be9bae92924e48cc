import { SPEEDS, type Clock } from "../replay/clock";
import { button, h, rename, say } from "./dom";
import { SIGNS } from "./signs";
import { seconds } from "./words";

interface Wishes {
  readonly event: (direction: 1 | -1) => void;
}

/** Play and pause, steps, events, speed. */
export class Transport {
  readonly element: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly pauseSign: Element;
  private readonly playSign: Element;
  private readonly speed: HTMLSelectElement;
  private readonly time = h("span", { class: "time" });
  private readonly step = h("span", { class: "step" });
  private playing: boolean | null = null;

  constructor(
    private readonly clock: Clock,
    wishes: Wishes,
  ) {
    this.play = button("Play", () => { clock.toggle(); }, SIGNS.play); // prettier-ignore
    this.play.classList.add("main");
    this.playSign = this.play.children[0];
    this.pauseSign = button("Pause", () => undefined, SIGNS.pause).children[0];
    this.speed = h("select", {
      on: {
        change: () => {
          clock.setSpeed(Number(this.speed.value));
        },
      },
    });
    for (const value of SPEEDS) {
      this.speed.append(h("option", { attributes: { value: String(value) } }, `${value} ×`));
    }
    const by = (name: string, steps: number, sign: string): HTMLButtonElement =>
      button(name, () => { clock.step(steps); }, sign); // prettier-ignore
    this.element = h(
      "div",
      { class: "row transport", attributes: { role: "group", "aria-label": "Playing" } },
      by("To the start", -Infinity, SIGNS.start),
      by("One step back", -1, SIGNS.back),
      this.play,
      by("One step forward", 1, SIGNS.forward),
      by("To the end", Infinity, SIGNS.end),
      h("span", { class: "clock" }, this.time, this.step),
      h("span", { class: "pair" },
        button("Previous event", () => { wishes.event(-1); }),
        button("Next event", () => { wishes.event(1); }),
      ),
      h("label", { class: "speed" }, "Speed ", this.speed),
    ); // prettier-ignore
  }

  update(step: number, last: number, stepS: number): void {
    const { playing, speed } = this.clock;
    if (playing !== this.playing) {
      this.playing = playing;
      this.play.replaceChildren(playing ? this.pauseSign : this.playSign);
      rename(this.play, playing ? "Pause" : "Play");
    }
    const value = String(speed);
    if (this.speed.value !== value) this.speed.value = value;
    say(this.time, seconds(step, stepS));
    say(this.step, `step ${step} of ${last}`);
  }
}
