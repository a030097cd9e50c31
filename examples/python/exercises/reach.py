# SPDX-License-Identifier: Apache-2.0
"""Exercise 2: how far does the tool come along x at some height? The refusals say it, within a millimetre."""

import corbot


def reach_along_x(arm: corbot.Arm, z: float = 0.08) -> float:
    """Give the largest x that the arm accepts, metres. 0.20 m must be accepted, and the arm's reach not."""
    near, far = 0.20, arm.reach + 0.01
    while far - near > 0.001:
        middle = (near + far) / 2
        try:
            arm.move(middle, 0.0, z)
            near = middle
        except (corbot.Unreachable, corbot.LimitExceeded):
            far = middle
    return near
