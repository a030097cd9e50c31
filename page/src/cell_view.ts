// SPDX-License-Identifier: Apache-2.0
// The part of the page that shows one cell.

import type { Order } from "./call.js";
import { CellDrawing } from "./cell_drawing.js";
import { CellGantt } from "./cell_gantt.js";
import { CellNeeds, needsOf } from "./cell_needs.js";
import type { CellDescription, CellState } from "./cell_state.js";
import { button, el, section, setText, timeOfDay } from "./dom.js";
import { authorization, TIMEOUT_MS } from "./stop.js";
import { T } from "./texts.js";

const PICTURE_INTERVAL_MS = 1000;

export class CellView {
  readonly root: HTMLElement;
  private readonly drawing: CellDrawing;
  private readonly gantt: CellGantt;
  private readonly needs: CellNeeds;
  private readonly summary = el("p", { class: "summary", role: "status" });
  private readonly rows = el("tbody");
  private readonly refusal = el("p", { class: "bad", role: "alert" });
  private readonly picture = el("img", { alt: T.pictureAlt });
  private readonly noPicture = el("p", { class: "hint" }, T.noPicture);
  private readonly timer: number;
  private isReading = false; // a picture is on its way

  /// `send` is null without the right to drive.
  constructor(private readonly cell: CellDescription, private readonly token: string,
              tool: (robot: string) => number[] | null,
              private readonly send: ((order: Order) => Promise<string>) | null) {
    this.drawing = new CellDrawing(cell, tool);
    this.gantt = new CellGantt(cell);
    this.needs = new CellNeeds(send && ((name, order) => void this.call(name, order)));
    const view = section(T.cellView, this.drawing.root, el("p", { class: "legend" }, T.cellLegend));
    view.classList.add("from-above");
    const heads = [T.robot, T.does, T.piece, T.step];
    const table = section(T.robots, el("table", {}, el("thead", {}, el("tr", {},
      ...heads.map((text) => el("th", { scope: "col" }, text)))), this.rows));
    const chart = section(T.gantt, this.gantt.root);
    chart.classList.add("chart");
    this.root = el("div", { class: "cell" }, el("div", { class: "state" }, this.needs.root, this.controls()),
                   view, table, section(T.camera, this.picture, this.noPicture), chart);
    this.picture.hidden = true;
    this.timer = window.setInterval(() => void this.readPicture(), PICTURE_INTERVAL_MS);
    void this.readPicture();
  }

  refresh(state: CellState): void {
    setText(this.summary, T.cellSummary(T.cellModes[state.mode] ?? state.mode, state.placed));
    this.needs.show(needsOf(this.cell, state));
    this.drawing.show(state);
    this.gantt.show(state);
    this.rows.replaceChildren(...state.works.map(({ name, state: own, piece, step, text }) => {
      const does = own === "moves" && state.mode === "paused" ? "paused" : own;
      const needsPerson = does === "attention" || does === "stopped";
      const reason = text && !needsPerson ? `: ${text}` : "";
      return el("tr", {}, el("th", { scope: "row" }, name),
        el("td", needsPerson ? { class: "bad" } : {}, (T.works[does] ?? does) + reason),
        el("td", { class: "number" }, piece ? String(piece) : T.none),
        el("td", {}, piece ? T.steps[step] ?? step : T.none));
    }));
  }

  close(): void {
    clearInterval(this.timer);
  }

  private controls(): HTMLElement {
    const order = (name: string, what: string): HTMLElement =>
      button(name, () => void this.call(name, { do: what }));
    const part = this.send
      ? el("p", { class: "buttons" }, order(T.startCell, "start"), order(T.pauseCell, "pause"))
      : el("p", { class: "hint" }, T.watchOnly);
    return section(T.work, this.summary, part, this.refusal);
  }

  private async call(name: string, order: Order): Promise<void> {
    this.refusal.textContent = "";
    const reason = await this.send?.(order);
    if (reason) this.refusal.textContent = T.at(timeOfDay(), T.refused(name, reason));
  }

  /// The address of a picture with a token would stay in logs, so the picture comes by a request of its own.
  private async readPicture(): Promise<void> {
    if (this.isReading) return; // a slow network must keep connections free for a Stop
    this.isReading = true;
    try {
      const reply = await fetch(`/api/cells/${this.cell.cell}/picture`,
                                { headers: authorization(this.token), cache: "no-store",
                                  signal: AbortSignal.timeout(TIMEOUT_MS) });
      this.picture.hidden = !reply.ok;
      this.noPicture.hidden = reply.ok;
      if (!reply.ok) return;
      const reader = new FileReader();
      reader.addEventListener("load", () => (this.picture.src = String(reader.result)));
      reader.readAsDataURL(await reply.blob());
    } catch {
      // The WebSocket reports a lost connection.
    } finally {
      this.isReading = false;
    }
  }
}
