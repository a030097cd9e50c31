// SPDX-License-Identifier: Apache-2.0
// Short ways to make and to change elements.

type Attributes = Record<string, string>;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/// A part of the page that screen readers list by its heading.
export function section(heading: string, ...children: Node[]): HTMLElement {
  return el("section", { "aria-label": heading }, el("h3", {}, heading), ...children);
}

export function button(text: string, press: () => void): HTMLButtonElement {
  const made = el("button", { type: "button" }, text);
  made.addEventListener("click", press);
  return made;
}

/// Leaves an element alone whose text is the same: a selection in it stays.
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function timeOfDay(time_s: number = Date.now() / 1000): string {
  return new Date(time_s * 1000).toLocaleTimeString("en-GB");
}

export function fixed(value: number | undefined, decimals: number, unit: string): string {
  return value !== undefined && Number.isFinite(value) ? `${value.toFixed(decimals)} ${unit}` : "–";
}
