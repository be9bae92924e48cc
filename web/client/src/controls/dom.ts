type Child = Node | string | null;

interface Properties {
  readonly class?: string;
  readonly attributes?: Readonly<Record<string, string>>;
  readonly on?: Readonly<Record<string, (event: Event) => void>>;
}

/** An element with its children; text goes in as text, never as markup. */
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

/** A sign of 16 by 16 from one path, beside or instead of a word that the control has in any case. */
export function icon(path: string): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS(SVG, "path");
  shape.setAttribute("d", path);
  svg.append(shape);
  return svg;
}

/** A button named by `name`; with a sign it shows that instead, and the name as its tip. */
export function button(name: string, pressed: () => void, sign?: string): HTMLButtonElement {
  const element = h("button", { attributes: { type: "button" }, on: { click: pressed } });
  if (sign === undefined) {
    element.append(name);
  } else {
    element.append(icon(sign));
    element.classList.add("sign");
    rename(element, name);
  }
  return element;
}

export function rename(element: HTMLElement, name: string): void {
  element.setAttribute("aria-label", name);
  element.title = name;
}

/** Writes only what differs: a text that is set anew is laid out anew. */
export function say(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
