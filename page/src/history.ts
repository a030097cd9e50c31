// SPDX-License-Identifier: Apache-2.0
// The joints' values of the last 30 seconds.

import type { ArmState, Joint } from "./state.js";

export const HISTORY_S = 30;
/// A longer time without a state is a gap in the plot.
const GAP_S = 1;

interface Row {
  time_s: number;
  commanded: (number | null)[];
  measured: (number | null)[];
}

export class History {
  private rows: Row[] = [];

  constructor(readonly joints: Joint[]) {}

  push(arm: ArmState): void {
    const last = this.rows.at(-1);
    if (!Number.isFinite(arm.time_s) || arm.time_s === last?.time_s) return;
    if (last && arm.time_s < last.time_s) this.rows = []; // the clock was set back
    const none = this.joints.map(() => null);
    if (last && arm.time_s - last.time_s > GAP_S)
      this.rows.push({ time_s: last.time_s + GAP_S / 2, commanded: none, measured: none });
    this.rows.push({ time_s: arm.time_s, commanded: arm.commanded, measured: arm.measured ?? none });
    const first = this.rows.findIndex((row) => row.time_s >= arm.time_s - HISTORY_S);
    if (first > 0) this.rows.splice(0, first);
  }

  copy(): History {
    const copy = new History(this.joints);
    copy.rows = [...this.rows];
    return copy;
  }

  /// Columns of the plot: seconds before the newest state, then set-point and measured value of each index.
  columns(indices: number[]): [number[], ...(number | null)[][]] {
    const end_s = this.rows.at(-1)?.time_s ?? 0;
    const values = indices.flatMap((i) => [
      this.rows.map((row) => row.commanded[i] ?? null),
      this.rows.map((row) => row.measured[i] ?? null),
    ]);
    return [this.rows.map((row) => row.time_s - end_s), ...values];
  }

  /// RFC 4180. The time is in seconds since the Unix epoch.
  csv(): string {
    const names = this.joints.flatMap(({ name, unit }) =>
      [`${name}_commanded_${unit}`, `${name}_measured_${unit}`]);
    const lines = this.rows.filter((row) => row.commanded.some((value) => value !== null)).map((row) => [
      row.time_s.toFixed(6),
      ...this.joints.flatMap((_, i) => [field(row.commanded[i]), field(row.measured[i])]),
    ]);
    return [["time_s", ...names.map(quoted)], ...lines].map((line) => line.join(",") + "\r\n").join("");
  }
}

function field(value: number | null | undefined): string {
  return value === null || value === undefined || !Number.isFinite(value) ? "" : String(value);
}

function quoted(name: string): string {
  return /[",\r\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name;
}
