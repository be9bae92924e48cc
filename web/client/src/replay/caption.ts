// Captions below saved pictures and videos: what they show, so that they are understood without the page.

import type { ColourName, Palette } from "./palette";

/** A piece of a caption's first line; with a colour, a square of that colour is before it. */
export interface CaptionPart {
  readonly text: string;
  readonly colour?: ColourName;
}

/** Two lines: what is shown, and the time. */
export interface Caption {
  readonly parts: readonly CaptionPart[];
  readonly detail: string;
}

/** Height of the caption, relative to the width of the picture. */
const HEIGHT_SHARE = 0.075;

/** Size of a picture of this width and height with its caption. Both are even, as video codecs require. */
export function captionedSize(width: number, height: number): { width: number; height: number } {
  const even = (value: number): number => 2 * Math.round(value / 2);
  return { width: even(width), height: even(height + width * HEIGHT_SHARE) };
}

/** Draws a picture and its caption into a canvas of the size of [`captionedSize`]. */
export function drawCaptioned(
  context: CanvasRenderingContext2D,
  picture: HTMLCanvasElement,
  caption: Caption,
  palette: Palette,
): void {
  const { width, height } = context.canvas;
  const bandHeight = Math.round(width * HEIGHT_SHARE);
  const pictureHeight = height - bandHeight;
  context.fillStyle = palette["rp-backdrop"];
  context.fillRect(0, 0, width, height);
  const drawnHeight = (picture.height / picture.width) * width;
  context.drawImage(picture, 0, (pictureHeight - drawnHeight) / 2, width, drawnHeight);
  context.fillStyle = palette.card;
  context.fillRect(0, pictureHeight, width, bandHeight);

  const size = bandHeight * 0.34;
  const padding = size * 0.8;
  let x = padding;
  const firstLine = pictureHeight + bandHeight * 0.3;
  context.textBaseline = "middle";
  context.font = `600 ${size}px system-ui, sans-serif`;
  for (const part of caption.parts) {
    if (part.colour !== undefined) {
      context.fillStyle = palette[part.colour];
      context.fillRect(x, firstLine - size * 0.4, size * 0.75, size * 0.75);
      x += size * 1.1;
    }
    context.fillStyle = palette.ink;
    context.fillText(part.text, x, firstLine, width - x - padding);
    x += context.measureText(part.text).width + size * 0.6;
  }
  context.font = `${size * 0.85}px system-ui, sans-serif`;
  context.fillStyle = palette.soft;
  context.fillText(caption.detail, padding, pictureHeight + bandHeight * 0.73, width - 2 * padding);
}
