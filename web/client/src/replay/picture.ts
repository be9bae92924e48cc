// The picture of a replay, in 3-D or flat.

import { h, setText } from "../controls/dom";
import { FlatView } from "../flat/view";
import { View3D } from "../view3d/view";
import type { Camera } from "./fragment";
import type { Palette } from "./palette";
import type { FrameState, View } from "./frame-state";

/** The picture, in 3-D or flat, with texts on it. */
export class Picture {
  readonly element: HTMLElement;
  private readonly canvasArea: HTMLElement;
  readonly view3d: View3D | null;
  /** Why 3-D is not available; null if it is. */
  unavailable: string | null = null;
  private readonly flatView = new FlatView();
  private readonly note = h("p", { class: "picture-note", attributes: { hidden: "" } });
  private readonly state = h("p", { class: "picture-state", attributes: { hidden: "" } });
  private readonly outcome = h("p", { class: "picture-outcome", attributes: { hidden: "" } });
  private readonly score = h("p", { class: "picture-score", attributes: { hidden: "" } });
  private wantsFlat = false;
  private ratio = 1;

  /** `changed`: called when the picture must be redrawn; `switched`: called after a change of the view. */
  constructor(
    title: string,
    prefersReducedMotion: boolean,
    changed: () => void,
    private readonly switched: () => void,
  ) {
    this.view3d = this.openView3d(prefersReducedMotion, changed);
    this.canvasArea = h(
      "div",
      {
        class: "canvas-area",
        attributes: { tabindex: "0", role: "group", "aria-label": `Picture: ${title}` },
      },
      this.flatView.canvas,
    );
    if (this.view3d !== null) this.canvasArea.prepend(this.view3d.canvas);
    this.element = h(
      "div",
      { class: "picture" },
      this.canvasArea,
      this.score,
      this.state,
      this.outcome,
      this.note,
    );
    for (const canvas of this.canvasArea.querySelectorAll("canvas"))
      canvas.setAttribute("aria-hidden", "true");
    new ResizeObserver(() => {
      this.resize();
      changed();
    }).observe(this.canvasArea);
    this.updateShownView();
  }

  get isFlat(): boolean {
    return this.wantsFlat || this.unavailable !== null;
  }

  setFlat(flat: boolean): void {
    this.wantsFlat = flat;
    this.updateShownView();
  }

  setCamera(camera: Camera): void {
    this.view3d?.orbit.preset(camera);
  }

  paint(palette: Palette): void {
    this.flatView.paint(palette);
    this.view3d?.paint(palette);
  }

  draw(frame: FrameState): number {
    return this.view().draw(frame);
  }

  /** Sets the texts on the picture; empty texts are hidden. */
  setTexts(texts: { state: string; outcome: string; good: boolean; score: string }): void {
    showText(this.state, texts.state);
    showText(this.score, texts.score);
    showText(this.outcome, texts.outcome);
    this.outcome.classList.toggle("good", texts.good);
  }

  /** The current picture as PNG. */
  toPng(frame: FrameState): Promise<Blob | null> {
    const view = this.view();
    // WebGL keeps the drawing only until the browser has shown it: draw and read in the same task.
    view.draw(frame);
    return new Promise((resolve) => {
      view.canvas.toBlob(resolve, "image/png");
    });
  }

  private view(): View {
    return this.isFlat || this.view3d === null ? this.flatView : this.view3d;
  }

  private openView3d(prefersReducedMotion: boolean, changed: () => void): View3D | null {
    try {
      const view = new View3D(prefersReducedMotion, changed);
      view.canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        this.unavailable = "3-D was stopped by the browser: the flat view is shown.";
        this.updateShownView();
      });
      view.canvas.addEventListener("webglcontextrestored", () => {
        this.unavailable = null;
        this.updateShownView();
      });
      return view;
    } catch {
      this.unavailable = "This browser has no 3-D support (WebGL): the flat view is shown.";
      return null;
    }
  }

  private updateShownView(): void {
    this.flatView.canvas.hidden = !this.isFlat;
    if (this.view3d !== null) this.view3d.canvas.hidden = this.isFlat;
    this.element.classList.toggle("flat", this.isFlat);
    showText(this.note, this.unavailable ?? "");
    this.switched();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvasArea;
    this.ratio = Math.min(devicePixelRatio, 2);
    this.flatView.resize(clientWidth, clientHeight, this.ratio);
    this.view3d?.resize(clientWidth, clientHeight, this.ratio);
  }
}

function showText(element: HTMLElement, text: string): void {
  setText(element, text);
  if (element.hidden !== (text === "")) element.hidden = text === "";
}
