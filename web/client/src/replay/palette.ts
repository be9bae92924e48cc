// Colours of the pictures, from the style sheet.

/** Colours of the pictures: custom properties of the style sheet, which defines the light and dark scheme. */
const NAMES = [
  "ground", "card", "ink", "soft", "line", "accent", "good", "fair", "poor",
  "rp-table", "rp-rim", "rp-mark", "rp-puck", "rp-arm", "rp-joint", "rp-other", "rp-other-joint",
  "rp-mallet", "rp-other-mallet", "rp-ghost", "rp-seen", "rp-commanded", "rp-trail", "rp-backdrop", "rp-floor",
  "rp-1", "rp-2", "rp-3", "rp-4", "rp-5", "rp-6", "rp-7",
] as const; // prettier-ignore

export type ColourName = (typeof NAMES)[number];
export type Palette = Readonly<Record<ColourName, string>>;

/** Colours of the second arm, which is quieter than the first. */
const OPPONENT = ["rp-other", "rp-other-joint", "rp-other-mallet"] as const;
/** Share of grey in a quieter colour. */
const GREY_SHARE = 0.5;

/** A colour with less saturation and the same brightness; other notations than `#rrggbb` stay as they are. */
export function quieter(colour: string): string {
  const digits = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(colour);
  if (digits === null) return colour;
  const [red, green, blue] = digits.slice(1).map((pair) => parseInt(pair, 16));
  const grey = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
  const mixed = [red, green, blue].map((part) => Math.round(part + (grey - part) * GREY_SHARE));
  return `#${mixed.map((part) => part.toString(16).padStart(2, "0")).join("")}`;
}

/** Reads the current colours of an element. */
export function paletteOf(element: Element): Palette {
  const style = getComputedStyle(element);
  const read = NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim() || "#888888"]);
  const palette = Object.fromEntries(read) as Record<ColourName, string>;
  for (const name of OPPONENT) palette[name] = quieter(palette[name]);
  return palette;
}
