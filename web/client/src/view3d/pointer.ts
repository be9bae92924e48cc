// Mouse and touch input of the 3-D view.

import type { Orbit } from "./orbit";

/** Dragging turns the camera. Touch turns sideways only: a vertical drag scrolls the page; buttons turn up and down. */
export function followPointer(canvas: HTMLCanvasElement, orbit: Orbit): void {
  let x = 0;
  let y = 0;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    x = event.clientX;
    y = event.clientY;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    orbit.drag(event.clientX - x, event.clientY - y);
    x = event.clientX;
    y = event.clientY;
  });
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
