import { h, setText } from "../controls/dom";
import { FlatView } from "../flat/view";
import { View3D } from "../view3d/view";
import type { Camera } from "./fragment";
import type { Palette } from "./palette";
import type { FrameState, View } from "./frame-state";

/** The picture, in 3-D or flat, with texts on it. */
export class Stage {
  readonly element: HTMLElement;
  private readonly field: HTMLElement;
  readonly solid: View3D | null;
  /** Why 3-D is not available; null if it is. */
  unavailable: string | null = null;
  private readonly plane = new FlatView();
  private readonly note = h("p", { class: "stage-note", attributes: { hidden: "" } });
  private readonly state = h("p", { class: "stage-state", attributes: { hidden: "" } });
  private readonly outcome = h("p", { class: "stage-outcome", attributes: { hidden: "" } });
  private readonly score = h("p", { class: "stage-score", attributes: { hidden: "" } });
  private wantsFlat = false;
  private ratio = 1;

  /** `changed`: called when the picture must be redrawn; `switched`: called after a change of the view. */
  constructor(
    title: string,
    still: boolean,
    changed: () => void,
    private readonly switched: () => void,
  ) {
    this.solid = this.openSolid(still, changed);
    this.field = h(
      "div",
      { class: "stage", attributes: { tabindex: "0", role: "group", "aria-label": `Picture: ${title}` } },
      this.plane.canvas,
    );
    if (this.solid !== null) this.field.prepend(this.solid.canvas);
    this.element = h(
      "div",
      { class: "picture" },
      this.field,
      this.score,
      this.state,
      this.outcome,
      this.note,
    );
    for (const canvas of this.field.querySelectorAll("canvas")) canvas.setAttribute("aria-hidden", "true");
    new ResizeObserver(() => {
      this.resize();
      changed();
    }).observe(this.field);
    this.choose();
  }

  get flat(): boolean {
    return this.wantsFlat || this.unavailable !== null;
  }

  setFlat(flat: boolean): void {
    this.wantsFlat = flat;
    this.choose();
  }

  setCamera(camera: Camera): void {
    this.solid?.orbit.preset(camera);
  }

  paint(palette: Palette): void {
    this.plane.paint(palette);
    this.solid?.paint(palette);
  }

  draw(frame: FrameState): number {
    return this.view().draw(frame);
  }

  /** Sets the texts on the picture; empty texts are hidden. */
  setTexts(texts: { state: string; outcome: string; good: boolean; score: string }): void {
    write(this.state, texts.state);
    write(this.score, texts.score);
    write(this.outcome, texts.outcome);
    this.outcome.classList.toggle("good", texts.good);
  }

  /** The current picture as PNG. */
  picture(frame: FrameState): Promise<Blob | null> {
    const view = this.view();
    // WebGL keeps the drawing only until the browser has shown it: draw and read in the same task.
    view.draw(frame);
    return new Promise((resolve) => {
      view.canvas.toBlob(resolve, "image/png");
    });
  }

  private view(): View {
    return this.flat || this.solid === null ? this.plane : this.solid;
  }

  private openSolid(still: boolean, changed: () => void): View3D | null {
    try {
      const view = new View3D(still, changed);
      view.canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        this.unavailable = "3-D was stopped by the browser: the flat view is shown.";
        this.choose();
      });
      view.canvas.addEventListener("webglcontextrestored", () => {
        this.unavailable = null;
        this.choose();
      });
      return view;
    } catch {
      this.unavailable = "This browser has no 3-D support (WebGL): the flat view is shown.";
      return null;
    }
  }

  private choose(): void {
    this.plane.canvas.hidden = !this.flat;
    if (this.solid !== null) this.solid.canvas.hidden = this.flat;
    this.element.classList.toggle("flat", this.flat);
    write(this.note, this.unavailable ?? "");
    this.switched();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.field;
    this.ratio = Math.min(devicePixelRatio, 2);
    this.plane.resize(clientWidth, clientHeight, this.ratio);
    this.solid?.resize(clientWidth, clientHeight, this.ratio);
  }
}

function write(element: HTMLElement, text: string): void {
  setText(element, text);
  if (element.hidden !== (text === "")) element.hidden = text === "";
}
