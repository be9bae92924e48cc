// The flat view: everything from above, on a 2-D canvas.

import type { Contest } from "../clip/motion";
import { pointsBetween, type Path } from "../motion/paths";
import { freshness, OPACITY_EXPONENT, WIDTH_EXPONENT } from "../motion/taper";
import type { Palette } from "../replay/palette";
import { trailRange, type FrameState, type View } from "../replay/frame-state";
import { drawArm, drawArmOutline, drawMallet, type ArmColours } from "./arm";
import { Projection } from "./projection";
import { drawPuck, drawSeenPuck } from "./puck";
import { drawTable } from "./table";

// Patterns of dashes: lengths of dash and gap, pixels.
const COMMANDED_DASHES = [5, 3];
const SOLID: number[] = [];
/** Width of a trail at its new end, pixels. */
const TRAIL_WIDTH = 3;
/** A trail is drawn in this number of parts, each of one width and opacity. */
const TRAIL_PARTS = 12;

/** The table from above, to scale, with its axes. Needs no WebGL. */
export class FlatView implements View {
  readonly canvas = document.createElement("canvas");
  private readonly context: CanvasRenderingContext2D;
  /** The static parts, drawn once and copied into each frame. */
  private readonly background = document.createElement("canvas");
  /** The arm of a ghost, drawn alone: its outline is made by erasing. */
  private readonly ghostArm = document.createElement("canvas");
  private projection = new Projection(1, 1);
  /** Device pixels per CSS pixel. */
  private ratio = 1;
  private palette: Palette | null = null;
  private arms: readonly [ArmColours, ArmColours] | null = null;
  private ghost: ArmColours | null = null;
  private backgroundContest: Contest | null = null;

  constructor() {
    const context = this.canvas.getContext("2d");
    if (context === null) throw new Error("this browser has no 2-D canvas");
    this.context = context;
  }

  resize(width: number, height: number, ratio: number): void {
    for (const canvas of [this.canvas, this.background, this.ghostArm]) {
      canvas.width = Math.max(Math.round(width * ratio), 1);
      canvas.height = Math.max(Math.round(height * ratio), 1);
    }
    this.ratio = ratio;
    this.projection = new Projection(width, height);
    this.backgroundContest = null;
  }

  paint(palette: Palette): void {
    this.palette = palette;
    const solid = { outline: palette["rp-table"], outlineWidth: 1, malletOpacity: 1 };
    const ghost = palette["rp-ghost"];
    this.arms = [
      { ...solid, link: palette["rp-joint"], mallet: palette["rp-mallet"] },
      { ...solid, link: palette["rp-other-joint"], mallet: palette["rp-other-mallet"] },
    ];
    this.ghost = { link: ghost, mallet: ghost, outline: ghost, outlineWidth: 2, malletOpacity: 0.2 };
    this.backgroundContest = null;
  }

  draw(frame: FrameState): number {
    const { context, projection: at, palette, arms } = this;
    if (palette === null || arms === null) return 0;
    const { motion, paths, observed } = frame.part;
    this.drawBackground(palette, motion.contest);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.background, 0, 0);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);

    for (let i = 0; i < motion.arms.length; i++) drawArm(context, at, frame.arms[i], arms[i]);
    if (frame.ghost !== null) this.drawGhost(frame.ghost, palette);
    const [from, to] = trailRange(frame);
    if (frame.layers.puck) {
      this.drawTrail(paths.puck, from, to, palette["rp-trail"]);
      this.drawContacts(frame, from, to, palette);
    }
    for (let i = 0; i < motion.arms.length; i++) drawMallet(context, at, frame.arms[i], arms[i]);
    if (frame.layers.mallet) {
      paths.mallets.forEach((path, side) => {
        this.drawTrail(path, from, to, palette[side === 0 ? "rp-mallet" : "rp-other-mallet"]);
      });
    }
    if (frame.layers.commanded && paths.commanded !== null) {
      const [first, last] = pointsBetween(paths.commanded, from, to);
      this.drawLine(paths.commanded, first, last, palette["rp-commanded"], COMMANDED_DASHES, 1.5);
    }
    drawPuck(context, at, frame, palette, "solid");
    if (observed !== null && frame.layers.seen) drawSeenPuck(context, at, frame, palette);
    return 0;
  }

  /** Draws another replay in outlines, below the puck and the mallets of this one. */
  private drawGhost(frame: FrameState, palette: Palette): void {
    const { context, projection: at, ghost } = this;
    const arm = this.ghostArm.getContext("2d");
    if (ghost === null || arm === null) return;
    arm.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    arm.clearRect(0, 0, at.width, at.height);
    drawArmOutline(arm, at, frame.arms[0], ghost);
    context.drawImage(this.ghostArm, 0, 0, at.width, at.height);
    const { paths } = frame.part;
    const [from, to] = trailRange(frame);
    if (frame.layers.puck) this.drawTrail(paths.puck, from, to, palette["rp-ghost"]);
    if (frame.layers.mallet) this.drawTrail(paths.mallets[0], from, to, palette["rp-ghost"]);
    drawMallet(context, at, frame.arms[0], ghost);
    drawPuck(context, at, frame, palette, "ghost");
  }

  private drawBackground(palette: Palette, contest: Contest): void {
    if (this.backgroundContest === contest) return;
    const context = this.background.getContext("2d");
    if (context === null) return;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    drawTable(context, this.projection, palette, contest);
    this.backgroundContest = contest;
  }

  /** A line that becomes narrower and paler towards its old end. */
  private drawTrail(path: Path, from: number, to: number, colour: string): void {
    const { context } = this;
    const [first, last] = pointsBetween(path, from, to);
    // The whole path has one width.
    const parts = from === -Infinity ? 1 : TRAIL_PARTS;
    const index = (part: number): number => first + Math.round(((last - first) * part) / parts);
    for (let i = 0; i < parts; i++) {
      const [start, end] = [index(i), index(i + 1)];
      if (end <= start) continue;
      const fresh = freshness((path.positions[start] + path.positions[end]) / 2, from, to);
      context.globalAlpha = fresh ** OPACITY_EXPONENT;
      this.drawLine(path, start, end, colour, SOLID, TRAIL_WIDTH * fresh ** WIDTH_EXPONENT);
    }
    context.globalAlpha = 1;
  }

  /** The line between two points of a path. */
  private drawLine(
    path: Path,
    first: number,
    last: number,
    colour: string,
    dashes: number[],
    width: number,
  ): void {
    const { context, projection: at } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.lineCap = "butt";
    context.setLineDash(dashes);
    context.beginPath();
    let pen = false;
    for (let i = first; i <= last; i++) {
      const x = at.x(path.points[3 * i]);
      const y = at.y(path.points[3 * i + 1]);
      if (pen) context.lineTo(x, y);
      else context.moveTo(x, y);
      pen = path.gaps[i] === 0;
    }
    context.stroke();
    context.setLineDash(SOLID);
  }

  private drawContacts(frame: FrameState, from: number, to: number, palette: Palette): void {
    const { context, projection: at } = this;
    const { contacts, stepS } = frame.part.motion;
    context.strokeStyle = palette["rp-trail"];
    context.lineWidth = 1;
    context.beginPath();
    for (const contact of contacts) {
      const position = contact.t / stepS;
      if (position < from || position > to) continue;
      const x = at.x(contact.x);
      const y = at.y(contact.y);
      context.moveTo(x + 3, y);
      context.arc(x, y, 3, 0, 2 * Math.PI);
    }
    context.stroke();
  }
}
