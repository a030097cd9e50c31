# SPDX-License-Identifier: Apache-2.0
"""Exercise 2: find how far the tool reaches along x at some height, from refusals, to a millimetre."""

import corbot


def reach_along_x(arm: corbot.Arm, z: float = 0.08) -> float:
    """Give the largest x that the arm accepts, metres. The arm must accept 0.20 m, and refuse its reach."""
    near, far = 0.20, arm.reach + 0.01
    while far - near > 0.001:
        middle = (near + far) / 2
        try:
            arm.move(middle, 0.0, z)
            near = middle
        except (corbot.Unreachable, corbot.LimitExceeded):
            far = middle
    return near
