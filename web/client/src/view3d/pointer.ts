// Mouse and touch input of the 3-D view.

import type { Orbit } from "./orbit";

/**
 * Dragging turns the camera, with mouse or pen in any direction. One finger turns sideways only, because a vertical drag
 * scrolls the page, unless the picture fills the screen. Two fingers zoom, turn and move the camera.
 */
export function followPointer(canvas: HTMLCanvasElement, orbit: Orbit): void {
  /** Pointers that are down, by id, in the order in which they went down. */
  const pointers = new Map<number, { x: number; y: number }>();

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const moved = pointers.get(event.pointerId);
    if (moved === undefined) return;
    const [dx, dy] = [event.clientX - moved.x, event.clientY - moved.y];
    const other = [...pointers.values()].find((pointer) => pointer !== moved);
    if (other === undefined) {
      orbit.drag(dx, dy);
    } else {
      const before = { x: moved.x - other.x, y: moved.y - other.y };
      const after = { x: event.clientX - other.x, y: event.clientY - other.y };
      const { angle, factor } = pinchOf(before, after);
      // The middle between the fingers moves by half of what one finger moves.
      orbit.pinch(dx / 2, dy / 2, angle, factor, canvas.clientHeight);
    }
    moved.x = event.clientX;
    moved.y = event.clientY;
  });
  for (const end of ["pointerup", "pointercancel"] as const) {
    canvas.addEventListener(end, (event) => {
      pointers.delete(event.pointerId);
    });
  }
  // The browser scrolls with one finger (style `touch-action`). Everything else is the camera's.
  const keepFromScrolling = (event: TouchEvent): void => {
    const isFullScreen = document.fullscreenElement?.contains(canvas) === true;
    if (event.cancelable && (isFullScreen || event.touches.length > 1)) event.preventDefault();
  };
  canvas.addEventListener("touchstart", keepFromScrolling, { passive: false });
  canvas.addEventListener("touchmove", keepFromScrolling, { passive: false });
  canvas.addEventListener(
    "wheel",
    (event) => {
      // Without Ctrl the wheel scrolls the page.
      if (!event.ctrlKey) return;
      event.preventDefault();
      orbit.zoom(event.deltaY < 0 ? 1 : -1);
    },
    { passive: false },
  );
}

interface Vector {
  readonly x: number;
  readonly y: number;
}

/** The turn (rad) and zoom of two fingers whose distance vector changes. */
export function pinchOf(before: Vector, after: Vector): { angle: number; factor: number } {
  const lengths = Math.hypot(before.x, before.y) * Math.hypot(after.x, after.y);
  if (lengths === 0) return { angle: 0, factor: 1 };
  const cross = before.x * after.y - before.y * after.x;
  const cosine = before.x * after.x + before.y * after.y;
  return {
    angle: Math.atan2(cross, cosine),
    factor: Math.hypot(after.x, after.y) / Math.hypot(before.x, before.y),
  };
}
