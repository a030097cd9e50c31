// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { History, HISTORY_S } from "../src/history.js";
import type { ArmState, Joint } from "../src/state.js";

const joints: Joint[] = [
  { name: "base", unit: "deg", lower: -90, upper: 90 },
  { name: 'a "b", c', unit: "m", lower: 0, upper: 1 },
];

function arm(time_s: number, measured: number[] | null = null): ArmState {
  return { time_s, commanded: [time_s, 0.5], measured } as ArmState;
}

test("Rows older than 30 s leave", () => {
  const history = new History(joints);
  for (let i = 0; i <= 400; ++i) history.push(arm(1000 + i / 10));
  const [times] = history.columns([0]);
  assert.equal(times.length, 10 * HISTORY_S + 1);
  assert.equal(times.at(-1), 0);
  assert.ok(Math.abs((times[0] ?? 0) + HISTORY_S) < 1e-9);
});

test("A state that came before is left out, and a clock that is set back begins anew", () => {
  const history = new History(joints);
  for (const time_s of [10, 10, 10.1, 5]) history.push(arm(time_s));
  assert.deepEqual(history.columns([0]), [[0], [5], [null]]);
});

test("A time without states is a gap", () => {
  const history = new History(joints);
  history.push(arm(10, [1, 2]));
  history.push(arm(15, [3, 4]));
  assert.deepEqual(history.columns([0]), [[-5, -4.5, 0], [10, null, 15], [1, null, 3]]);
  assert.equal(history.csv().split("\r\n").length, 4); // head, two rows, the end
});

test("The CSV has set-points and measured values with units, and quotes names", () => {
  const history = new History(joints);
  history.push(arm(1, [7, NaN]));
  history.push(arm(1.5));
  assert.equal(history.csv(), 'time_s,base_commanded_deg,base_measured_deg,"a ""b"", c_commanded_m",' +
    '"a ""b"", c_measured_m"\r\n1.000000,1,7,0.5,\r\n1.500000,1.5,,0.5,\r\n');
});

test("A copy stays as it is", () => {
  const history = new History(joints);
  history.push(arm(1));
  const copy = history.copy();
  history.push(arm(2));
  assert.equal(copy.columns([0])[0].length, 1);
});
