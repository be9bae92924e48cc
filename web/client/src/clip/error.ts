/** The clip cannot be loaded or drawn. The message is shown to the visitor. */
export class ClipError extends Error {
  override readonly name = "ClipError";
}
