# SPDX-License-Identifier: Apache-2.0
"""Exercise 4: a second thread stops a motion; give how far it had come, and move home."""

import contextlib
import threading

import corbot


def interrupted(arm: corbot.Arm, after: float = 0.5) -> float:
    """Give the share of the path at which the arm came to rest, 0 to 1."""
    motion = arm.joints([60, 0, 0, 0], time=4.0, wait=False)
    threading.Timer(after, arm.stop).start()
    with contextlib.suppress(corbot.Stopped):  # the expected end
        motion.wait()
    came = arm.state.joints[0] / 60
    arm.ready()
    return came
