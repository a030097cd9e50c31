// SPDX-License-Identifier: Apache-2.0
// The part of the page that shows how punctual the real-time task is.

import { el, fixed, section, setText } from "./dom.js";
import type { LoopState } from "./state.js";
import { T } from "./texts.js";

/// Returns a time in the unit that suits it.
export function duration(time_s: number): string {
  return time_s < 0.001 ? fixed(1e6 * time_s, 0, "µs") : fixed(1e3 * time_s, 1, "ms");
}

/// A row of the histogram: the range, its cycles, and the length of its bar, 0 to 1.
export interface Bar {
  label: string;
  count: number;
  length: number;
}

/// Returns the bars from the first to the last that has cycles. Their lengths are logarithmic, because a
/// single late cycle matters beside millions.
export function bars({ counts, edges_s }: LoopState): Bar[] {
  const longest = Math.log10(1 + Math.max(1, ...counts));
  const all = counts.map((count, i) => {
    const edge = edges_s[i];
    return {
      label: edge === undefined ? T.from(duration(edges_s.at(-1) ?? 0)) : T.upTo(duration(edge)),
      count,
      length: Math.log10(1 + count) / longest,
    };
  });
  const isFilled = ({ count }: Bar): boolean => count > 0;
  const first = all.findIndex(isFilled);
  return first < 0 ? [] : all.slice(first, all.findLastIndex(isFilled) + 1);
}

export class LoopView {
  readonly root: HTMLElement;
  private readonly summary = el("p");
  private readonly rows = el("tbody");
  private shown = "";

  constructor() {
    const heads = [T.latency, T.cycles, ""].map((text) => el("th", { scope: "col" }, text));
    this.root = section(T.loop, this.summary,
                        el("table", {}, el("thead", {}, el("tr", {}, ...heads)), this.rows),
                        el("p", { class: "hint" }, T.loopHint));
    this.root.classList.add("whole", "loop");
  }

  show(loop: LoopState | null): void {
    const key = JSON.stringify(loop);
    if (key === this.shown) return;
    this.shown = key;
    if (!loop) return setText(this.summary, T.none);
    const { period_s, overruns, mean_s, max_s, work_max_s, isRealTime } = loop;
    setText(this.summary, T.loopSummary(
      { period: duration(period_s), mean: duration(mean_s), max: duration(max_s),
        work: duration(work_max_s), overruns }, isRealTime));
    this.rows.replaceChildren(...bars(loop).map(({ label, count, length }) => el("tr", {},
      el("th", { scope: "row" }, label), el("td", { class: "number" }, String(count)),
      el("td", {}, el("progress", { max: "1", value: String(length), "aria-hidden": "true" })))));
  }
}
