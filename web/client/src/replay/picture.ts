// The picture of a replay, in 3-D or flat.

import { h, setText } from "../controls/dom";
import { FlatView } from "../flat/view";
import { View3D } from "../view3d/view";
import type { SideNames } from "./events";
import type { Camera, CameraPosition } from "./fragment";
import type { Palette } from "./palette";
import type { FrameState, View } from "./frame-state";

/** A pointer that moves farther than this between press and release has dragged, not clicked. */
const MAX_CLICK_PX = 5;

/** Device pixels per CSS pixel of a saved picture. */
const SAVED_RATIO = 2;

/** Texts on the picture; empty texts are hidden. */
export interface PictureTexts {
  readonly state: string;
  readonly outcome: string;
  /** Is the outcome a success? */
  readonly isSuccess: boolean;
  /** Score of a game. */
  readonly score: readonly [number, number] | null;
}

interface PictureOptions {
  readonly title: string;
  /** Names of the sides of a game, for the score. */
  readonly names: SideNames;
  readonly prefersReducedMotion: boolean;
  /** Called when the picture must be redrawn. */
  readonly changed: () => void;
  /** Called after a change between the 3-D and the flat view. */
  readonly switched: () => void;
  /** Called after a click that was no drag. */
  readonly clicked: () => void;
}

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
  private readonly points = h("span", { class: "points" });
  private readonly score: HTMLElement;
  private wantsFlat = false;
  private ratio = 1;
  private coveredPx = 0;

  constructor(private readonly options: PictureOptions) {
    this.view3d = this.openView3d();
    this.canvasArea = h(
      "div",
      {
        class: "canvas-area",
        attributes: { tabindex: "0", role: "group", "aria-label": `Picture: ${options.title}` },
      },
      this.flatView.canvas,
    );
    if (this.view3d !== null) this.canvasArea.prepend(this.view3d.canvas);
    const [home, away] = options.names;
    this.score = h(
      "p",
      { class: "picture-score", attributes: { hidden: "" } },
      h("span", { class: "side side-1" }, home),
      this.points,
      h("span", { class: "side side-2" }, away),
    );
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
    this.listenForClicks();
    new ResizeObserver(() => {
      this.resize();
      options.changed();
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

  /** The camera: a preset, or a position after manual turning; null without 3-D. */
  get camera(): Camera | CameraPosition | null {
    if (this.view3d === null) return null;
    const { camera, x, y, z, azimuth, elevation, distance } = this.view3d.orbit;
    return camera ?? { x, y, z, azimuth, elevation, distance };
  }

  setCamera(camera: Camera | CameraPosition): void {
    if (typeof camera === "string") this.view3d?.orbit.preset(camera);
    else this.view3d?.orbit.restore(camera);
  }

  /** Controls cover the bottom of the picture: the table is drawn above them. */
  setCovered(heightPx: number): void {
    if (heightPx === this.coveredPx) return;
    this.coveredPx = heightPx;
    this.element.style.setProperty("--covered", `${heightPx}px`);
    this.resize();
    this.options.changed();
  }

  paint(palette: Palette): void {
    this.flatView.paint(palette);
    this.view3d?.paint(palette);
  }

  draw(frame: FrameState): number {
    return this.view().draw(frame);
  }

  setTexts(texts: PictureTexts): void {
    showText(this.state, texts.state);
    showText(this.outcome, texts.outcome);
    this.outcome.classList.toggle("good", texts.isSuccess);
    if (texts.score !== null) setText(this.points, `${texts.score[0]} : ${texts.score[1]}`);
    this.score.hidden = texts.score === null;
  }

  /** The drawing of the last frame. WebGL keeps it only until the end of the task. */
  get canvas(): HTMLCanvasElement {
    return this.view().canvas;
  }

  /** Draws with the resolution of saved pictures, calls `use` with the drawing, and returns to the resolution of the screen. */
  drawForSaving(frame: FrameState, use: (drawing: HTMLCanvasElement) => void): void {
    const view = this.view();
    const { clientWidth: width, clientHeight: height } = this.canvasArea;
    if (view === this.flatView) {
      view.resize(width, height, SAVED_RATIO);
    } else {
      // On a slow machine the 3-D view has fewer pixels per unit of its size: a larger size makes up for it.
      const size = (SAVED_RATIO * width) / Math.max(view.canvas.width, 1);
      view.resize(width * size, height * size, this.ratio);
    }
    view.draw(frame);
    use(view.canvas);
    this.resize();
    view.draw(frame);
  }

  private view(): View {
    return this.isFlat || this.view3d === null ? this.flatView : this.view3d;
  }

  private openView3d(): View3D | null {
    const { prefersReducedMotion, changed } = this.options;
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

  private listenForClicks(): void {
    let start: { x: number; y: number } | null = null;
    let farthestPx = 0;
    const follow = (event: PointerEvent): void => {
      if (start === null) return;
      farthestPx = Math.max(farthestPx, Math.hypot(event.clientX - start.x, event.clientY - start.y));
    };
    this.canvasArea.addEventListener("pointerdown", (event) => {
      start = { x: event.clientX, y: event.clientY };
      farthestPx = 0;
    });
    this.canvasArea.addEventListener("pointermove", follow);
    this.canvasArea.addEventListener("pointerup", follow);
    this.canvasArea.addEventListener("click", () => {
      const isClick = farthestPx <= MAX_CLICK_PX;
      start = null;
      if (isClick) this.options.clicked();
    });
  }

  private updateShownView(): void {
    this.flatView.canvas.hidden = !this.isFlat;
    if (this.view3d !== null) this.view3d.canvas.hidden = this.isFlat;
    this.element.classList.toggle("flat", this.isFlat);
    showText(this.note, this.unavailable ?? "");
    this.options.switched();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvasArea;
    this.ratio = Math.min(devicePixelRatio, 2);
    this.flatView.resize(clientWidth, Math.max(clientHeight - this.coveredPx, 1), this.ratio);
    this.view3d?.resize(clientWidth, clientHeight, this.ratio, this.coveredPx);
  }
}

function showText(element: HTMLElement, text: string): void {
  setText(element, text);
  if (element.hidden !== (text === "")) element.hidden = text === "";
}
