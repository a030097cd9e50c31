# SPDX-License-Identifier: Apache-2.0
"""Draws a square by lines with a Lynx 5, and prints the largest deviation of the tool. square.py [ROBOT]"""

import sys

import numpy as np

import corbot

CORNERS = [(0.18, -0.03), (0.24, -0.03), (0.24, 0.03), (0.18, 0.03)]  # metres
PEN = 0.08  # the height of the paper, metres


def draw(arm: corbot.Arm) -> corbot.Recording:
    """Give the recorded motion, a reading each 5 ms."""
    arm.move(*CORNERS[0], PEN)
    with corbot.record(arm, rate=200) as drawn:
        for corner in CORNERS[1:] + CORNERS[:1]:
            arm.line(*corner, PEN)
    return drawn


def deviation(drawn: corbot.Recording) -> float:
    """Give the largest distance of the tool from the square's nearest side, metres."""
    (left, near), (right, far) = CORNERS[0], CORNERS[2]
    x, y, z = drawn.tool.T
    to_sides = np.minimum.reduce([np.abs(x - left), np.abs(x - right), np.abs(y - near), np.abs(y - far)])
    return float(np.hypot(to_sides, z - PEN).max())


if __name__ == "__main__":
    run = draw(corbot.connect(sys.argv[1] if len(sys.argv) > 1 else None))
    print(f"The tool was at most {1000 * deviation(run):.3f} mm off the square, in {run.time[-1]:.1f} s.")
