// Recording of a video, with a recorder that the test controls instead of the browser's.

import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { VideoRecording } from "../src/replay/recorder";

class FakeRecorder extends EventTarget {
  static last: FakeRecorder;
  static startsWith: Error | null = null;
  state = "inactive";
  stops = 0;

  constructor(readonly stream: unknown) {
    super();
    FakeRecorder.last = this;
  }

  start(): void {
    if (FakeRecorder.startsWith !== null) throw FakeRecorder.startsWith;
    this.state = "recording";
  }

  stop(): void {
    if (this.state === "inactive") throw new Error("it does not record");
    this.stops++;
    this.end();
  }

  /** What the browser does at the end, by its own decision or by that of the visitor. */
  end(): void {
    this.state = "inactive";
    this.dispatchEvent(Object.assign(new Event("dataavailable"), { data: new Blob(["video"]) }));
    this.dispatchEvent(new Event("stop"));
  }

  fail(): void {
    this.state = "inactive";
    this.dispatchEvent(new Event("error"));
    this.end();
  }
}

describe("a video", () => {
  const track = { stop: vi.fn() };

  beforeEach(() => {
    FakeRecorder.startsWith = null;
    track.stop.mockClear();
    const canvas = { getContext: () => ({}), captureStream: () => ({ getTracks: () => [track] }) };
    vi.stubGlobal("document", { createElement: () => canvas });
    vi.stubGlobal("MediaRecorder", FakeRecorder);
  });

  afterEach(() => {
    vi.unstubAllGlobals();
  });

  it("is there after the visitor has ended it", async () => {
    const video = new VideoRecording({ width: 4, height: 2 });
    video.stop();
    expect(await (await video.file).text()).toBe("video");
    expect(FakeRecorder.last.stops).toBe(1);
    expect(track.stop).toHaveBeenCalledOnce();
  });

  it("is there after the browser has ended it", async () => {
    const video = new VideoRecording({ width: 4, height: 2 });
    FakeRecorder.last.end();
    video.stop();
    expect(await (await video.file).text()).toBe("video");
    expect(FakeRecorder.last.stops).toBe(0);
  });

  it("is refused after an error of the browser", async () => {
    const video = new VideoRecording({ width: 4, height: 2 });
    FakeRecorder.last.fail();
    await expect(video.file).rejects.toThrow("the browser ended the recording");
  });

  it("is refused if the browser cannot start", () => {
    FakeRecorder.startsWith = new Error("not supported");
    expect(() => new VideoRecording({ width: 4, height: 2 })).toThrow("not supported");
  });
});
