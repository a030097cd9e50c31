# SPDX-License-Identifier: Apache-2.0
"""Exercise 3: draw a circle by two arcs, and show by a recording how round it is."""

import numpy as np

import corbot

CENTRE, RADIUS = (0.20, 0.0, 0.08), 0.02  # metres


def circle(arm: corbot.Arm) -> float:
    """Give the largest deviation from the circle, metres."""
    x, y, z = CENTRE
    west, north, east, south = (x - RADIUS, y, z), (x, y + RADIUS, z), (x + RADIUS, y, z), (x, y - RADIUS, z)
    arm.move(*west)
    with corbot.record(arm, rate=200) as drawn:
        arm.arc(west, north, east)
        arm.arc(east, south, west)
    offsets = drawn.tool - np.array(CENTRE)
    return float(np.hypot(np.hypot(offsets[:, 0], offsets[:, 1]) - RADIUS, offsets[:, 2]).max())
