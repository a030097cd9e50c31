// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { bars, duration } from "../src/loop_view.js";
import { parseUpdate } from "../src/state.js";

const LOOP = {
  period_s: 0.02, since_s: 0, cycles: 1010, overruns: 1, latency_mean_s: 5e-5, latency_max_s: 0.004,
  work_max_s: 2e-4, real_time: true, latency_counts: [0, 999, 0, 10, 0, 1, 0],
  latency_edges_s: [1e-5, 1e-4, 2e-4, 5e-4, 1e-3, 5e-3],
};
const read = (loop: unknown) =>
  parseUpdate(JSON.stringify({ robot: "left", number: 1, connected: true, loop }))?.arm?.loop ?? null;

test("The histogram of the loop is read, and an older panel has none", () => {
  assert.equal(read(LOOP)?.overruns, 1);
  assert.equal(read(undefined), null);
});

test("The bars reach from the first to the last range with cycles, and a single cycle is seen", () => {
  const loop = read(LOOP);
  assert.ok(loop);
  const shown = bars(loop);
  assert.deepEqual(shown.map(({ count }) => count), [999, 0, 10, 0, 1]);
  assert.equal(shown[0]?.length, 1);
  assert.equal(shown[1]?.length, 0);
  assert.ok((shown[4]?.length ?? 0) > 0.09);
  assert.equal(shown[4]?.label, "up to 5.0 ms");
  assert.equal(bars({ ...loop, counts: [0, 0, 0, 0, 0, 0, 2] })[0]?.label, "from 5.0 ms");
  assert.deepEqual(bars({ ...loop, counts: [0, 0] }), []);
});

test("Short times have microseconds", () => {
  assert.deepEqual([2e-5, 0.0123].map(duration), ["20 µs", "12.3 ms"]);
});
