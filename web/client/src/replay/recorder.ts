// Recording of a span as a video, in the browser.

/** Largest width of a video in pixels. */
export const MAX_VIDEO_WIDTH = 1280;

const TYPE = "video/webm";
const FRAMES_PER_S = 30;
const BITS_PER_S = 6_000_000;

/** Can this browser record a canvas as WebM? */
export function canRecord(): boolean {
  // Undefined in some browsers, contrary to its type.
  const recorder = window.MediaRecorder as typeof MediaRecorder | undefined;
  return (
    recorder !== undefined &&
    recorder.isTypeSupported(TYPE) &&
    // eslint-disable-next-line @typescript-eslint/no-unnecessary-condition -- absent in some browsers
    HTMLCanvasElement.prototype.captureStream !== undefined
  );
}

/** A running recording of a canvas. The constructor throws if the browser cannot start it. */
export class VideoRecording {
  readonly context: CanvasRenderingContext2D;
  /** The video, when the recording has ended; the browser may end it, too. Rejected if it could not be recorded. */
  readonly file: Promise<Blob>;
  private readonly recorder: MediaRecorder;
  private readonly parts: Blob[] = [];

  constructor(size: { width: number; height: number }) {
    const canvas = document.createElement("canvas");
    canvas.width = size.width;
    canvas.height = size.height;
    const context = canvas.getContext("2d");
    if (context === null) throw new Error("this browser has no 2-D canvas");
    this.context = context;
    this.recorder = new MediaRecorder(canvas.captureStream(FRAMES_PER_S), {
      mimeType: TYPE,
      videoBitsPerSecond: BITS_PER_S,
    });
    this.recorder.addEventListener("dataavailable", (event) => this.parts.push(event.data));
    this.file = new Promise((resolve, reject) => {
      this.recorder.addEventListener("stop", () => { resolve(new Blob(this.parts, { type: TYPE })); });
      this.recorder.addEventListener("error", () => { reject(new Error("the browser ended the recording")); });
    }); // prettier-ignore
    this.recorder.start();
  }

  /** Ends the recording. */
  stop(): void {
    if (this.recorder.state !== "inactive") this.recorder.stop();
    for (const track of this.recorder.stream.getTracks()) track.stop();
  }
}
