// SPDX-License-Identifier: Apache-2.0
// How much the drawing of the arm shows. Lengths are in lengths of the outstretched arm.

/// Where the camera stands, and the point at which it looks.
export const CAMERA = [1.6, 1.3, 1.6];
export const TARGET = [0, 0.3, 0];
/// A ball about the target with all positions of an arm that stands on a base.
const RADIUS = 0.9;

/// Returns the camera's angle of view from below to above. A picture of this aspect, width to height, shows
/// the ball as a whole.
export function viewAngle_deg(aspect: number): number {
  const distance = Math.hypot(...CAMERA.map((value, i) => value - (TARGET[i] ?? 0)));
  const half = Math.tan(Math.asin(RADIUS / distance));
  return 2 * Math.atan(half / Math.min(1, aspect)) * 180 / Math.PI;
}
