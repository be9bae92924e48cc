// Colours of the pictures, from the style sheet.

/** Colours of the pictures: custom properties of the style sheet, which defines the light and dark scheme. */
const NAMES = [
  "ground", "card", "ink", "soft", "line", "accent", "good", "fair", "poor",
  "rp-table", "rp-rim", "rp-mark", "rp-puck", "rp-arm", "rp-joint", "rp-other", "rp-other-joint",
  "rp-mallet", "rp-other-mallet", "rp-seen", "rp-commanded", "rp-trail", "rp-backdrop", "rp-floor",
  "rp-1", "rp-2", "rp-3", "rp-4", "rp-5", "rp-6", "rp-7",
] as const; // prettier-ignore

export type ColourName = (typeof NAMES)[number];
export type Palette = Readonly<Record<ColourName, string>>;

/** Reads the current colours of an element. */
export function paletteOf(element: Element): Palette {
  const style = getComputedStyle(element);
  const read = NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim() || "#888888"]);
  return Object.fromEntries(read) as Palette;
}
