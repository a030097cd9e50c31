// SPDX-License-Identifier: Apache-2.0
// Short ways to make elements of a drawing.

const NAMESPACE = "http://www.w3.org/2000/svg";
type Attributes = Record<string, string | number>;

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: (Node | string)[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS(NAMESPACE, tag);
  for (const [name, value] of Object.entries(attributes))
    element.setAttribute(name, typeof value === "number" ? value.toFixed(1) : value);
  element.append(...children);
  return element;
}
