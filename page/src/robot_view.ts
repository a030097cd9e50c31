// SPDX-License-Identifier: Apache-2.0
// The part of the page that shows one robot.

import { Arm3d } from "./arm3d.js";
import { absentControls, Controls, type Send } from "./controls.js";
import { el, fixed, section, setText, timeOfDay } from "./dom.js";
import { LoopView } from "./loop_view.js";
import { Plots } from "./plots.js";
import { ProgramView, type Run } from "./program_view.js";
import { type ArmState, type Description, type ProgramState, toolAngles_deg } from "./state.js";
import { remedy, T } from "./texts.js";

/// A label, its value, and if the value asks for attention.
type Field = [string, (arm: ArmState) => string, ((arm: ArmState) => boolean)?];

const yesNo = (value: boolean): string => (value ? T.yes : T.no);
const percent = (value: number): string => fixed(value, 0, "%");
const millimetres = (index: number) => (arm: ArmState): string =>
  fixed(1000 * (arm.position_m[index] ?? NaN), 1, "mm");
const angle = (index: number) => (arm: ArmState): string =>
  fixed(toolAngles_deg(arm.orientation_wxyz)[index], 1, "°");
const milliseconds = (age_s: number): string => fixed(1000 * age_s, 0, "ms");

const FIELDS: [string, Field[]][] = [
  [T.status, [
    [T.state, (arm) => T.states[arm.state] ?? arm.state, (arm) => arm.state === "Error"],
    [T.paused, (arm) => yesNo(arm.paused), (arm) => arm.paused],
    [T.ticket, (arm) => (arm.motion ? String(arm.motion.ticket) : T.none)],
    [T.progress, (arm) => (arm.motion ? percent(100 * arm.motion.progress) : T.none)],
    [T.duration, (arm) => (arm.motion ? fixed(arm.motion.duration_s, 1, "s") : T.none)],
    [T.queued, (arm) => fixed(arm.queued, 0, "")],
    [T.override, (arm) => percent(arm.overridePercent)],
  ]],
  [T.tool, [
    ["X", millimetres(0)], ["Y", millimetres(1)], ["Z", millimetres(2)],
    ["A", angle(0)], ["B", angle(1)], ["C", angle(2)],
  ]],
  [T.gripper, [
    [T.commanded, (arm) => percent(arm.gripper.commandedPercent)],
    [T.opening, (arm) => (arm.gripper.measured ? percent(arm.gripper.openingPercent) : T.notMeasured)],
    [T.holding, (arm) => arm.gripper.holding],
  ]],
  [T.device, [
    [T.backend, (arm) => arm.device.backend],
    [T.health, (arm) => arm.device.health, (arm) => arm.device.health !== "open"],
    [T.cause, (arm) => arm.device.cause || T.none, (arm) => arm.device.cause !== ""],
    [T.setPointAge, (arm) => milliseconds(arm.device.age_s)],
    [T.measuredAge, (arm) => (arm.device.measured ? milliseconds(arm.device.measuredAge_s) : T.notMeasured)],
    [T.unverified, (arm) => yesNo(arm.device.isUncertain), (arm) => arm.device.isUncertain],
    [T.emergencyStop, (arm) => (arm.device.isStopped ? T.active : T.no), (arm) => arm.device.isStopped],
  ]],
  [T.control, [
    [T.holder, (arm) => arm.control.holder || T.noHolder],
    [T.left, (arm) => (arm.control.holder ? fixed(arm.control.left_s, 0, "s") : T.none)],
    [T.hold, (arm) => yesNo(arm.control.isHeld), (arm) => arm.control.isHeld],
  ]],
];

export class RobotView {
  readonly root: HTMLElement;
  private readonly refreshers: ((arm: ArmState) => void)[] = [];
  private readonly plots: Plots;
  private readonly drawing: Arm3d | null;
  private readonly legend = el("p", { class: "legend" });

  private readonly program: ProgramView;
  private readonly loop = new LoopView();

  /// `send` and `run` are null without the right to drive.
  constructor(private readonly description: Description, send: Send | null, run: Run | null) {
    this.program = new ProgramView(run);
    this.plots = new Plots(description.robot, description.joints);
    this.drawing = this.makeDrawing();
    const fields = FIELDS.map(([heading, rows]) => this.fields(heading, rows));
    this.root = el("div", { class: "robot" }, this.view(), this.alarms(), this.joints(), this.drive(send),
                   this.program.root, ...fields, this.servant(), this.plots.root, this.loop.root);
  }

  /// Takes each state: the drawing and the plots need all.
  take(arm: ArmState): void {
    this.drawing?.show(arm);
    this.plots.push(arm);
  }

  /// Shows this state in the texts and plots; ten times a second is enough to read.
  refresh(arm: ArmState): void {
    for (const refresh of this.refreshers) refresh(arm);
    this.plots.draw();
    this.loop.show(arm.loop);
    setText(this.legend, arm.measured ? T.viewLegend : T.viewLegendOne);
  }

  showProgram(program: ProgramState | null): void {
    this.program.show(program);
  }

  close(): void {
    this.plots.close();
    this.drawing?.close();
  }

  private makeDrawing(): Arm3d | null {
    try {
      return new Arm3d(this.description);
    } catch (error) {
      console.warn(error);
      return null;
    }
  }

  private view(): HTMLElement {
    if (!this.drawing) return section(T.view, el("p", {}, T.viewMissing));
    this.drawing.canvas.setAttribute("role", "img");
    this.drawing.canvas.setAttribute("aria-label", T.viewLabel);
    const part = section(T.view, this.drawing.canvas, this.legend);
    part.classList.add("view");
    return part;
  }

  private drive(send: Send | null): HTMLElement {
    if (!send) return absentControls();
    const controls = new Controls(send);
    this.refreshers.push((arm) => controls.refresh(arm));
    return controls.root;
  }

  private joints(): HTMLElement {
    const heads = [T.joint, T.setPoint, T.measured, T.speed, T.range, T.position];
    const body = el("tbody");
    this.description.joints.forEach(({ name, unit, lower, upper }, i) => {
      const [sign, decimals] = unit === "m" ? ["m", 4] as const : ["°", 2] as const;
      const cells = [0, 1, 2].map(() => el("td", { class: "number" }));
      const meter = el("meter", { min: String(lower), max: String(upper), "aria-label": T.position });
      const ends = `${lower.toFixed(decimals - 1)} … ${fixed(upper, decimals - 1, sign)}`;
      const range = el("td", { class: "number" }, ends);
      const head = el("th", { scope: "row" }, `${i} ${name}`);
      body.append(el("tr", {}, head, ...cells, range, el("td", {}, meter)));
      this.refreshers.push((arm) => {
        const texts = [fixed(arm.commanded[i], decimals, sign), fixed(arm.measured?.[i], decimals, sign),
                       fixed(arm.speeds[i], decimals, `${sign}/s`)];
        cells.forEach((cell, n) => setText(cell, texts[n] ?? ""));
        const value = arm.measured?.[i] ?? arm.commanded[i] ?? NaN;
        if (Number.isFinite(value)) meter.value = value;
        meter.classList.toggle("bad", value < lower || value > upper);
      });
    });
    const head = el("thead", {}, el("tr", {}, ...heads.map((text) => el("th", { scope: "col" }, text))));
    // The focus lets the keyboard scroll it.
    const scrolls = { class: "scrolls", tabindex: "0", role: "group", "aria-label": T.joints };
    const part = section(T.joints, el("div", scrolls, el("table", {}, head, body)));
    part.classList.add("wide");
    return part;
  }

  private fields(heading: string, fields: Field[]): HTMLElement {
    const rows = el("dl");
    for (const [label, text, isBad] of fields) {
      const value = el("dd");
      rows.append(el("dt", {}, label), value);
      this.refreshers.push((arm) => {
        setText(value, text(arm));
        value.classList.toggle("bad", isBad?.(arm) ?? false);
      });
    }
    const part = section(heading, rows);
    return part;
  }

  private servant(): HTMLElement {
    const { address, version, profile, started_s } = this.description;
    const started = Number.isFinite(started_s) ? new Date(1000 * started_s).toLocaleString("en-GB") : T.none;
    const rows = [[T.address, address], [T.version, version], [T.profile, profile], [T.started, started]];
    const cells = rows.flatMap(([label, text]) => [el("dt", {}, label ?? ""), el("dd", {}, text ?? "")]);
    return section(T.servant, el("dl", {}, ...cells));
  }

  private alarms(): HTMLElement {
    const list = el("ul", { class: "alarms" });
    let shown = "";
    this.refreshers.push(({ alarms }) => {
      const key = JSON.stringify(alarms);
      if (key === shown) return;
      shown = key;
      list.replaceChildren(...alarms.map(({ time_s, code, text }) => el("li", {},
        el("strong", {}, `${timeOfDay(time_s)}  ${code}`), el("p", {}, text),
        el("p", {}, T.remedy(remedy(code))))));
      if (alarms.length === 0) list.append(el("li", { class: "none" }, T.noAlarms));
    });
    const part = section(T.alarms, list);
    part.classList.add("wide");
    return part;
  }
}
