# SPDX-License-Identifier: Apache-2.0
"""Exercise 1: the tool climbs in steps; give the height after each."""

import corbot


def staircase(arm: corbot.Arm, steps: int = 5, rise: float = 0.01) -> list[float]:
    """Give the heights, metres."""
    arm.move(0.20, 0.05, 0.05)
    heights = []
    for _ in range(steps):
        arm.relative(z=rise, line=True)
        heights.append(arm.state.tool.position.z)
    return heights
