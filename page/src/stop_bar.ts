// SPDX-License-Identifier: Apache-2.0
// The bar with the Stop, which is always on the page, and its keys.

import { el, timeOfDay } from "./dom.js";
import { isStopKey, sendsStop } from "./keys.js";
import { type StopLine, Stops, type Target } from "./stop.js";
import { T } from "./texts.js";

/// A press of a pointer sends the Stop; the click that follows it within this time does not.
const CLICK_MS = 1000;

export class StopBar {
  private readonly result = el("div", { class: "result", role: "alert" });
  private readonly stops: Stops;
  readonly root: HTMLElement;

  constructor(token: () => string) {
    this.stops = new Stops(token, (result) => this.show(result));
    const stop = stopButton(T.stop, () => this.press());
    stop.className = "stop";
    stop.setAttribute("aria-label", T.stopLabel);
    this.root = el("section", { class: "stop-bar", "aria-label": T.stop }, stop,
                   el("div", {}, this.result, el("p", { class: "hint" }, T.stopHint)));
    window.addEventListener("keydown", (event) => {
      if (sendsStop(event)) this.press();
      if (isStopKey(event)) swallow(event);
    }, true);
    window.addEventListener("keyup", (event) => {
      if (isStopKey(event)) swallow(event); // a space would press the button that has the focus
    }, true);
  }

  /// Stops all robots and cells, or the one that is named.
  press(target?: Target): void {
    void this.stops.press(target);
  }

  private show(result: StopLine[] | null): void {
    const time = timeOfDay();
    const lines = result?.map(({ isAtRest, text }) =>
      el("p", { class: isAtRest ? "good" : "bad" }, T.at(time, text)));
    this.result.replaceChildren(...(lines ?? [el("p", {}, T.at(time, T.stopSent))]));
  }
}

export function stopButton(text: string, press: () => void): HTMLButtonElement {
  const made = el("button", { type: "button" }, text);
  let pressed_ms = -Infinity;
  made.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    pressed_ms = event.timeStamp;
    press();
  });
  made.addEventListener("click", (event) => {
    if (event.timeStamp - pressed_ms > CLICK_MS) press();
  });
  return made;
}

function swallow(event: Event): void {
  event.preventDefault();
  event.stopPropagation();
}
