// SPDX-License-Identifier: Apache-2.0
// Plots of the joints' set-points and measured values, one for each unit.

import uPlot from "uplot";

import { button, el, section } from "./dom.js";
import { History, HISTORY_S } from "./history.js";
import type { ArmState, Joint } from "./state.js";
import { T } from "./texts.js";

const COLOURS = ["#d1495b", "#2f7fd1", "#2e933c", "#b9770e", "#8e5cc2", "#1b998b"];
const HEIGHT = 220;

export class Plots {
  readonly root: HTMLElement;
  private readonly history: History;
  private frozen: History | null = null;
  private readonly plots: { plot: uPlot; indices: number[] }[] = [];
  private readonly resizes = new ResizeObserver(() => this.resize());
  private readonly holder = el("div", { class: "plots" });
  private readonly pause = button(T.pause, () => this.togglePause());

  constructor(private readonly robot: string, joints: Joint[]) {
    this.history = new History(joints);
    this.root = section(T.plots, el("p", { class: "buttons" }, this.pause, button(T.csv, () => this.save())),
                        this.holder, el("p", { class: "legend" }, T.plotLegend));
    this.root.classList.add("whole");
    for (const unit of ["deg", "m"]) {
      const indices = joints.flatMap((joint, i) => (joint.unit === unit ? [i] : []));
      if (indices.length > 0) this.plots.push({ plot: this.makePlot(unit, indices, joints), indices });
    }
    this.resizes.observe(this.holder);
  }

  push(arm: ArmState): void {
    this.history.push(arm);
  }

  draw(): void {
    if (this.frozen) return;
    for (const { plot, indices } of this.plots) plot.setData(this.history.columns(indices));
  }

  close(): void {
    this.resizes.disconnect();
    for (const { plot } of this.plots) plot.destroy();
  }

  private makePlot(unit: string, indices: number[], joints: Joint[]): uPlot {
    const colour = (): string => getComputedStyle(document.body).color;
    const axis = { stroke: colour, grid: { stroke: "#80808040" }, ticks: { stroke: "#80808040" } };
    const series = indices.flatMap((i, n): uPlot.Series[] => {
      const stroke = COLOURS[n % COLOURS.length] ?? "gray";
      const name = joints[i]?.name ?? "";
      return [
        { label: name, stroke, width: 1.5 },
        { label: `${name}, ${T.measured.toLowerCase()}`, stroke, width: 1, dash: [4, 4] },
      ];
    });
    const frame = el("div", { role: "img", "aria-label": T.plotLabel(unit) });
    this.holder.append(frame);
    return new uPlot({
      width: 300,
      height: HEIGHT,
      scales: { x: { time: false, range: [-HISTORY_S, 0] } },
      axes: [{ ...axis, label: T.time }, { ...axis, label: unit, size: 60 }],
      series: [{ label: T.time }, ...series],
      legend: { live: false },
      cursor: { drag: { x: false, y: false } },
    }, [[], ...series.map(() => [])], frame);
  }

  private resize(): void {
    const width = this.holder.clientWidth;
    if (width > 0) this.plots.forEach(({ plot }) => plot.setSize({ width, height: HEIGHT }));
  }

  private togglePause(): void {
    this.frozen = this.frozen ? null : this.history.copy();
    this.pause.textContent = this.frozen ? T.resume : T.pause;
    this.draw();
  }

  /// Saves what the plots show.
  private save(): void {
    const url = URL.createObjectURL(new Blob([(this.frozen ?? this.history).csv()], { type: "text/csv" }));
    el("a", { href: url, download: `${this.robot}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  }
}
