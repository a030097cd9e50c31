// SPDX-License-Identifier: Apache-2.0
// The part of the page that drives one robot.

import type { Order } from "./call.js";
import { button, el, section, setText, timeOfDay } from "./dom.js";
import type { ArmState } from "./state.js";
import { T } from "./texts.js";

/// Sends a call. Returns "" when the robot has accepted it, otherwise the reason why it is not.
export type Send = (order: Order) => Promise<string>;

const POSITION_DECIMALS = 4;

/// Reads a number that a person typed. Returns null for an empty text, NaN for anything else.
export function readNumber(typed: string): number | null {
  const trimmed = typed.trim();
  if (trimmed === "") return null;
  const isDecimal = /^[-+\d.e]+$/i.test(trimmed); // Number reads 0x10, too
  return isDecimal && Number.isFinite(Number(trimmed)) ? Number(trimmed) : NaN;
}

/// The part of a person without the right to drive.
export function absentControls(): HTMLElement {
  const part = section(T.drive, el("p", { class: "hint" }, T.watchOnly));
  part.classList.add("wide");
  return part;
}

export class Controls {
  readonly root: HTMLElement;
  private readonly refusal = el("p", { class: "bad", role: "alert" });
  private readonly outcome = el("p", { class: "hint", role: "status" }, T.noOutcome);
  private readonly slider =
    el("input", { type: "range", min: "1", max: "100", step: "1", id: "override" });
  private readonly sliderValue = el("output", { for: "override", class: "number" });
  private isSliding = false;
  private sent = 0;
  private slides = 0; // overrides that were sent
  private arm: ArmState | null = null;

  constructor(private readonly send: Send) {
    const order = (text: string, what: string): HTMLElement =>
      button(text, () => void this.call(text, { do: what }));
    this.root = section(T.drive, this.refusal, this.outcome,
      el("p", { class: "buttons" }, order(T.ready, "ready"), order(T.openGripper, "open"),
         order(T.closeGripper, "close"), order(T.clear, "clear"), order(T.acquire, "acquire"),
         order(T.release, "release")),
      el("p", { class: "hint" }, T.controlHint),
      this.pointForm(), this.overrideForm(),
      el("div", { class: "pair" }, this.percentForm(T.speed, "speed"),
         this.percentForm(T.gripper, "gripper")));
    this.root.classList.add("wide", "drive");
  }

  refresh(arm: ArmState): void {
    this.arm = arm;
    if (this.isSliding || !Number.isFinite(arm.overridePercent)) return;
    this.slider.value = String(arm.overridePercent);
    setText(this.sliderValue, `${this.slider.value} %`);
  }

  /// Shows the result of the newest call; an older one may still be under way.
  private async call(name: string, order: Order): Promise<void> {
    const number = ++this.sent;
    this.show("", T.callSent(name));
    const reason = await this.send(order);
    if (number !== this.sent) return;
    if (reason) this.show(T.refused(name, reason), "");
    else this.show("", T.done(name));
  }

  private show(refusal: string, outcome: string): void {
    const at = (text: string): string => (text ? T.at(timeOfDay(), text) : "");
    this.refusal.textContent = at(refusal); // also if it is the same: it is then read out again
    this.outcome.textContent = at(outcome);
    this.outcome.className = "good";
    if (refusal) this.refusal.scrollIntoView({ block: "nearest" });
  }

  private pointForm(): HTMLElement {
    const fields = ["X", "Y", "Z"].map((axis) => numberField(`point-${axis}`, T.axis(axis)));
    const time = numberField("point-time", T.moveTime);
    const fill = button(T.fillPoint, () => fields.forEach(({ input }, i) => {
      const value = this.arm?.position_m[i];
      if (value !== undefined && Number.isFinite(value)) input.value = value.toFixed(POSITION_DECIMALS);
    }));
    const form = this.form(T.moveTo, [...fields, time], T.move, (values) => {
      const time_s = values.pop() ?? null;
      if (values.includes(null)) return T.pointIncomplete;
      return { do: "move", to_m: values as number[], ...(time_s === null ? {} : { time_s }) };
    }, fill);
    return el("div", {}, el("h4", {}, T.moveTo), form);
  }

  private percentForm(name: string, what: string): HTMLElement {
    const field = numberField(`${what}-percent`, T.percent(name));
    return this.form(name, [field], T.set, ([percent]) =>
      (typeof percent === "number" ? { do: what, percent } : T.percentMissing));
  }

  /// A form of numbers. `toOrder` returns the order, or the reason why there is none.
  private form(name: string, fields: Field[], submit: string,
               toOrder: (values: (number | null)[]) => Order | string, ...more: Node[]): HTMLElement {
    const form = el("form", { "aria-label": name, novalidate: "", autocomplete: "off" },
      ...fields.map(({ root }) => root), el("button", { type: "submit" }, submit), ...more);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const values = fields.map(({ input }) => readNumber(input.value));
      const wrong = fields.filter((_, i) => Number.isNaN(values[i]));
      fields.forEach((field) => field.input.setAttribute("aria-invalid", String(wrong.includes(field))));
      wrong[0]?.input.focus();
      const order = wrong[0] ? T.noNumber(wrong[0].label, wrong[0].input.value) : toOrder(values);
      if (typeof order === "string") this.show(T.refused(name, order), "");
      else void this.call(name, order);
    });
    return form;
  }

  /// The slider sends its value when it is let go, and follows the robot's otherwise.
  private overrideForm(): HTMLElement {
    this.slider.addEventListener("input", () => {
      this.isSliding = true;
      setText(this.sliderValue, `${this.slider.value} %`);
    });
    this.slider.addEventListener("change", () => {
      const number = ++this.slides;
      void this.call(T.override, { do: "override", percent: Number(this.slider.value) }).then(() => {
        if (number === this.slides) this.isSliding = false;
      });
    });
    return el("div", { class: "slider" }, el("label", { for: "override" }, T.override), this.slider,
              this.sliderValue);
  }
}

interface Field {
  label: string;
  input: HTMLInputElement;
  root: HTMLElement;
}

function numberField(id: string, label: string): Field {
  const input = el("input", { type: "text", inputmode: "decimal", id, size: "6" });
  return { label, input, root: el("label", { for: id }, el("span", {}, label), input) };
}
