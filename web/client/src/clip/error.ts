/** What was asked for is not a clip that this viewer can draw; the message is shown to the reader as it is. */
export class ClipError extends Error {
  override readonly name = "ClipError";
}
