// Pictures and videos of replays, saved as files.

import { saveFile } from "../controls/data";
import { captionedSize, drawCaptioned } from "./caption";
import type { Clock } from "./clock";
import type { Palette } from "./palette";
import { MAX_VIDEO_WIDTH, VideoRecording } from "./recorder";
import type { Viewer } from "./viewer";

/** A recording that is running, with the colours at its start. */
interface RunningRecording {
  readonly video: VideoRecording;
  readonly palette: Palette;
}

/** What the saver needs from its player. */
export interface SaverOptions {
  readonly clock: Clock;
  readonly step: () => number;
  readonly announce: (text: string) => void;
  /** Shows why something could not be saved. */
  readonly failed: (reason: string) => void;
  readonly recordingChanged: (isRecording: boolean) => void;
}

/** Saves what viewers show. */
export class Saver {
  private recording: RunningRecording | null = null;

  constructor(private readonly options: SaverOptions) {}

  /** Saves a picture of a replay. */
  savePicture(viewer: Viewer): void {
    const frame = viewer.drawnFrame;
    if (frame === null) return;
    const canvas = document.createElement("canvas");
    viewer.picture.drawForSaving(frame, (drawing) => {
      Object.assign(canvas, captionedSize(drawing.width, drawing.height));
      const context = canvas.getContext("2d");
      if (context !== null) drawCaptioned(context, drawing, viewer.caption(), viewer.palette);
    });
    canvas.toBlob((picture) => {
      if (picture === null) this.options.failed("The picture could not be saved.");
      else saveFile(picture, this.fileName(viewer, "png"));
    }, "image/png");
  }

  /** Starts a video at the current moment, or ends it and saves it. */
  toggleRecording(viewer: Viewer): void {
    const { clock, announce } = this.options;
    if (this.recording !== null) {
      const { video } = this.recording;
      this.clearRecording();
      clock.pause();
      video.stop();
      return;
    }
    const { canvas } = viewer.picture;
    const width = Math.min(canvas.width, MAX_VIDEO_WIDTH);
    const size = captionedSize(width, (canvas.height / canvas.width) * width);
    const failed = (): void => { this.options.failed("The video could not be recorded."); }; // prettier-ignore
    let video: VideoRecording;
    try {
      video = new VideoRecording(size);
    } catch {
      failed();
      return;
    }
    this.recording = { video, palette: viewer.palette };
    this.options.recordingChanged(true);
    video.file
      .finally(() => {
        // The browser has ended it, not the visitor.
        if (this.recording?.video === video) this.clearRecording();
      })
      .then((file) => {
        saveFile(file, this.fileName(viewer, "webm"));
        announce("Video saved");
      })
      .catch(failed);
    announce("Recording");
    clock.play();
  }

  /** Ends a recording at the end of its replay. */
  endRecording(viewer: Viewer): void {
    if (this.recording !== null) this.toggleRecording(viewer);
  }

  /** Adds the drawing that a viewer has just made to the video. */
  addFrame(viewer: Viewer): void {
    if (this.recording === null) return;
    const { video, palette } = this.recording;
    drawCaptioned(video.context, viewer.picture.canvas, viewer.caption(), palette);
  }

  private clearRecording(): void {
    this.recording = null;
    this.options.recordingChanged(false);
  }

  private fileName(viewer: Viewer, extension: string): string {
    const { title } = viewer;
    const slug = title.toLowerCase().replaceAll(/[^a-z0-9]+/g, "-").replaceAll(/^-|-$/g, ""); // prettier-ignore
    return `${slug || "replay"}-step-${this.options.step()}.${extension}`;
  }
}
