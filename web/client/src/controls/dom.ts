// Helpers to create HTML elements.

type Child = Node | string | null;

interface Properties {
  readonly class?: string;
  readonly attributes?: Readonly<Record<string, string>>;
  readonly on?: Readonly<Record<string, (event: Event) => void>>;
}

/** Creates an element with children (hyperscript); strings are inserted as text, never as markup. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (properties.class !== undefined) element.className = properties.class;
  for (const [name, value] of Object.entries(properties.attributes ?? {})) element.setAttribute(name, value);
  for (const [name, listener] of Object.entries(properties.on ?? {}))
    element.addEventListener(name, listener);
  element.append(...children.filter((child) => child !== null));
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

/** An SVG drawing of paths, hidden from screen readers: what it shows has a text in any case. */
export function drawing(viewBox: string, paths: readonly { d: string; class?: string }[]): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", viewBox);
  svg.setAttribute("aria-hidden", "true");
  for (const path of paths) {
    const shape = document.createElementNS(SVG, "path");
    shape.setAttribute("d", path.d);
    if (path.class !== undefined) shape.setAttribute("class", path.class);
    svg.append(shape);
  }
  return svg;
}

/** An icon of 16 × 16 from one path. */
export function icon(path: string): SVGSVGElement {
  return drawing("0 0 16 16", [{ d: path }]);
}

/** A button with the accessible name `name`. With an icon, the name is shown as tooltip only. */
export function button(name: string, pressed: () => void, iconPath?: string): HTMLButtonElement {
  const element = h("button", { attributes: { type: "button" }, on: { click: pressed } });
  if (iconPath === undefined) {
    element.append(name);
  } else {
    element.append(icon(iconPath));
    element.classList.add("icon-button");
    rename(element, name);
  }
  return element;
}

/** Sets the accessible name and the tooltip. */
export function rename(element: HTMLElement, name: string): void {
  element.setAttribute("aria-label", name);
  element.title = name;
}

/** Sets the text if it differs; setting an equal text would cause a new layout. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
