// Icons of the buttons.

/** SVG paths of the icons, in a box of 16 × 16. */
export const ICONS = {
  play: "M4 2.5v11l9-5.5z",
  pause: "M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z",
  back: "M11.5 3v10L5 8zM3 3h1.8v10H3z",
  forward: "M4.5 3v10L11 8zM11.2 3H13v10h-1.8z",
  start: "M14 3v10L8.5 8zM8 3v10L2.5 8zM1 3h1.4v10H1z",
  end: "M2 3v10l5.5-5zM8 3v10l5.5-5zM13.6 3H15v10h-1.4z",
  left: "M10.5 2.5L5 8l5.5 5.5 1.2-1.2L7.4 8l4.3-4.3z",
  right: "M5.5 2.5L11 8l-5.5 5.5-1.2-1.2L8.6 8 4.3 3.7z",
  up: "M2.5 10.5L8 5l5.5 5.5-1.2 1.2L8 7.4l-4.3 4.3z",
  down: "M2.5 5.5L8 11l5.5-5.5-1.2-1.2L8 8.6 3.7 4.3z",
  closer: "M7.1 3h1.8v4.1H13v1.8H8.9V13H7.1V8.9H3V7.1h4.1z",
  farther: "M3 7.1h10v1.8H3z",
  full: "M2 2h5v1.7H3.7V7H2zM9 2h5v5h-1.7V3.7H9zM2 9h1.7v3.3H7V14H2zM12.3 9H14v5H9v-1.7h3.3z",
} as const;
