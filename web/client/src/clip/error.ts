// The error of a clip that cannot be loaded or drawn.

/** The clip cannot be loaded or drawn. The message is shown to the visitor. */
export class ClipError extends Error {
  override readonly name = "ClipError";
}
