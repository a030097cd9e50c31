// SPDX-License-Identifier: Apache-2.0
// The needs of a cell that wait for a person, and the answers that the person can give.

import type { Order } from "./call.js";
import type { CellDescription, CellState, PieceEvent } from "./cell_state.js";
import { button, el } from "./dom.js";
import { T } from "./texts.js";

/// An answer of a person. `means` says what follows from it. Choices of one group stand behind its text.
export interface Choice {
  group: string;
  label: string;
  means: string;
  order: Order;
}

export interface Need {
  text: string;
  choices: Choice[];
}

/// Returns where the piece may be: gone, in an area, or in a slot where no other piece is known to stand.
function choicesFor({ piece }: PieceEvent, { places }: CellDescription, { pieces }: CellState): Choice[] {
  const isTaken = (place: string, slot: number): boolean => pieces.some((other) =>
    other.number !== piece && other.place === place && other.slot === slot &&
    ["placed", "withdrawn", "unclear"].includes(other.step));
  const order = { do: "resolve", piece };
  const choice = (label: string, means: string, more: Partial<Order>, group = ""): Choice =>
    ({ group, label, means, order: { ...order, ...more } });
  return [
    choice(T.isGone, T.isGoneMeans(piece), { gone: true }),
    ...places.flatMap(({ name, slots_m }) => (slots_m.length === 0
      ? [choice(T.isIn(name), T.isInMeans(piece, name), { place: name })]
      : slots_m.map((_, slot) => slot).filter((slot) => !isTaken(name, slot)).map((slot) =>
        choice(String(slot), T.isInSlotMeans(piece, name, slot), { place: name, slot }, T.inSlotOf(name))))),
  ];
}

/// Returns what waits for a person.
export function needsOf(cell: CellDescription, state: CellState): Need[] {
  const isFull = ({ name, pieces, capacity }: CellState["places"][number]): boolean =>
    capacity > 0 && pieces >= capacity && cell.places.some((place) => place.name === name && place.isLast);
  const one = (text: string, ...choices: Omit<Choice, "group">[]): Need =>
    ({ text, choices: choices.map((choice) => ({ group: "", ...choice })) });
  return [
    ...state.works.filter((work) => work.state === "attention" || work.state === "stopped")
      .map(({ name, text }) => one(T.robotNeeds(name, text),
        { label: T.goOn(name), means: T.goOnMeans, order: { do: "start" } })),
    ...(state.storeFault ? [one(state.storeFault)] : []),
    ...state.unclear.map((event) => ({
      text: T.unclear(event.piece, event.robot, event.place, event.note),
      choices: choicesFor(event, cell, state),
    })),
    ...state.places.filter(isFull).map(({ name }) => one(T.isFull(name),
      { label: T.isEmptied(name), means: T.isEmptiedMeans(name), order: { do: "exchange", place: name } })),
  ];
}

interface Shown {
  need: string; // as JSON
  element: HTMLElement;
}

/// The list of needs. The confirmation is no dialog of the browser, which would keep Esc from the arms.
export class CellNeeds {
  readonly root = el("div", { class: "needs", role: "alert" });
  private readonly heading = el("b", {}, T.needsPerson);
  private shown: Shown[] = [];

  /// `answer` is null without the right to drive.
  constructor(private readonly answer: ((name: string, order: Order) => void) | null) {}

  /// Leaves the list alone if nothing has changed, and a need that a person answers at the moment.
  show(needs: Need[]): void {
    const before = this.shown;
    const isBusy = ({ element }: Shown): boolean => element.contains(document.activeElement);
    this.shown = needs.map((need) => {
      const now = JSON.stringify(need);
      const same = before.find((old) => old.need === now ||
        (isBusy(old) && old.element.firstChild?.textContent === need.text));
      return same ?? { need: now, element: this.element(need) };
    });
    if (before.length === needs.length && before.every((old, i) => old === this.shown[i])) return;
    for (const old of before) if (!this.shown.includes(old)) old.element.remove();
    if (needs.length === 0) this.heading.remove();
    else if (!this.heading.isConnected) this.root.prepend(this.heading);
    this.shown.forEach(({ element }, i) => {
      const at = this.root.children[i + 1] ?? null;
      if (at !== element) this.root.insertBefore(element, at);
    });
  }

  private element({ text, choices }: Need): HTMLElement {
    const part = el("div", { class: "answers" });
    let group: HTMLElement | null = null;
    choices.forEach((choice, i) => {
      if (!this.answer) return;
      if (!group || choice.group !== choices[i - 1]?.group) {
        group = el("p", { class: "buttons" }, ...(choice.group ? [el("span", {}, choice.group)] : []));
        part.append(group);
      }
      group.append(button(choice.label, () => this.ask(part, choice)));
    });
    return el("div", { class: "need" }, el("p", {}, text), part);
  }

  private ask(part: HTMLElement, { group, label, means, order }: Choice): void {
    const before = [...part.childNodes];
    const name = group ? `${group} ${label}` : label;
    const restore = (): void => part.replaceChildren(...before);
    const confirm = button(T.confirm, () => {
      restore();
      this.answer?.(`"${name}"`, order);
    });
    // Enter that is held since the press on the choice confirms nothing.
    confirm.addEventListener("keydown", (event) => event.repeat && event.preventDefault());
    part.replaceChildren(el("p", { class: "means" }, `${name}. ${means}`),
                         el("p", { class: "buttons" }, confirm, button(T.cancel, restore)));
    confirm.focus();
  }
}
