// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { CAMERA, TARGET, viewAngle_deg } from "../src/view_angle.js";

/// Where the picture shows a point: 0 is its middle, -1 and 1 are its edges.
function toPicture(point: number[], aspect: number): [number, number] {
  const minus = (a: number[], b: number[]): number[] => a.map((value, i) => value - (b[i] ?? 0));
  const dot = (a: number[], b: number[]): number => a.reduce((sum, value, i) => sum + value * (b[i] ?? 0), 0);
  const unit = (a: number[]): number[] => a.map((value) => value / Math.hypot(...a));
  const cross = ([a = 0, b = 0, c = 0]: number[], [x = 0, y = 0, z = 0]: number[]): number[] =>
    [b * z - c * y, c * x - a * z, a * y - b * x];
  const ahead = unit(minus(TARGET, CAMERA));
  const right = unit(cross(ahead, [0, 1, 0]));
  const from_camera = minus(point, CAMERA);
  const half = dot(from_camera, ahead) * Math.tan(viewAngle_deg(aspect) * Math.PI / 360);
  return [dot(from_camera, right) / half / aspect, dot(from_camera, cross(right, ahead)) / half];
}

test("A narrow, a square and a wide drawing show the arm in each direction", () => {
  for (const aspect of [0.5, 0.88, 1, 2]) {
    for (let turn = 0; turn < 24; ++turn) {
      const [x, z] = [Math.cos(turn * Math.PI / 12), Math.sin(turn * Math.PI / 12)];
      // The base is a fifth of the arm.
      for (const tool of [[0.8 * x, 0.2, 0.8 * z], [0.56 * x, 0.76, 0.56 * z], [0, 1, 0]])
        assert.ok(toPicture(tool, aspect).every((value) => Math.abs(value) < 1), `${aspect}: ${tool}`);
    }
  }
});
