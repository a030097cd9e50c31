// SPDX-License-Identifier: Apache-2.0
// The Gantt chart of the last minute: which robot did which step of its work on a piece when.

import { barsOf, type CellDescription, type CellState } from "./cell_state.js";
import { el } from "./dom.js";
import { svg } from "./svg.js";
import { T } from "./texts.js";

const SHOWN_S = 60;
const TICK_S = 10;
const NAME_HEIGHT = 22;
const BAR_HEIGHT = 34;
const LANE_HEIGHT = 78;
const AXIS_HEIGHT = 24;
/// Part of the lane that the bar of each step fills: height and colour each distinguish the steps.
const HEIGHTS: Record<string, number> = { reserved: 0.35, picking: 1, held: 0.65, placing: 1 };

export class CellGantt {
  private readonly drawing = svg("svg", { class: "gantt", role: "img", "aria-label": T.ganttLabel });
  readonly root = el("div", {}, this.drawing, el("p", { class: "legend keys" },
    ...Object.entries(T.ganttSteps).map(([step, name]) =>
      el("span", {}, el("i", { class: `key ${step}` }), name))));

  constructor(private readonly cell: CellDescription) {}

  show(state: CellState): void {
    const width = this.drawing.clientWidth || 300;
    const height = LANE_HEIGHT * this.cell.robots.length + AXIS_HEIGHT;
    const begin_s = state.time_s - SHOWN_S;
    const x = (time_s: number): number => (time_s - begin_s) / SHOWN_S * width;
    const ticks: Node[] = [];
    for (let ago_s = TICK_S; ago_s < SHOWN_S; ago_s += TICK_S) {
      const at = x(state.time_s - ago_s);
      ticks.push(svg("line", { class: "grid", x1: at, x2: at, y1: 0, y2: height - AXIS_HEIGHT }),
                 svg("text", { class: "tick", x: at, y: height - 6 }, T.secondsAgo(ago_s)));
    }
    const bars = barsOf(state.events, begin_s, state.time_s);
    const lanes = this.cell.robots.map(({ name }, i) => {
      const top = i * LANE_HEIGHT;
      const bottom = top + NAME_HEIGHT + 14 + BAR_HEIGHT;
      const own = bars.filter(({ robot }) => robot === name);
      const numbers = own.filter(({ step, begin_s: at }) => step === "reserved" || at === begin_s);
      return svg("g", {}, svg("text", { x: 0, y: top + 16 }, name),
        svg("line", { class: "axis", x1: 0, x2: width, y1: bottom, y2: bottom }),
        ...own.map(({ step, begin_s: from, end_s: to }) => {
          const tall = BAR_HEIGHT * (HEIGHTS[step] ?? 1);
          return svg("rect", { class: step, x: x(from), y: bottom - tall, width: x(to) - x(from),
                               height: tall });
        }),
        ...numbers.map(({ piece, begin_s: from }) =>
          svg("text", { class: "number", x: x(from), y: top + NAME_HEIGHT + 11 }, String(piece))));
    });
    this.drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.drawing.setAttribute("height", String(height));
    this.drawing.replaceChildren(...ticks, ...lanes);
  }
}
