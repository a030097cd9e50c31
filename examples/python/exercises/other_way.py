# SPDX-License-Identifier: Apache-2.0
"""Exercise 5: move the arm to another of its solutions at the present pose of the tool."""

import corbot


def other_way(arm: corbot.Arm) -> corbot.Solution | None:
    """Give the solution to which the arm moved, the nearest within its limits; None if there is no other."""
    state = arm.state
    others = [
        s
        for s in arm.solutions(state.tool)
        if s.within_limits and s.number != arm.solution and s.orientation_error < 0.01
    ]
    if not others:
        return None
    nearest = min(others, key=lambda s: max(abs(a - b) for a, b in zip(s.joints, state.joints, strict=True)))
    arm.joints(nearest.joints)
    return nearest
