# SPDX-License-Identifier: Apache-2.0
"""What several tests share."""

from __future__ import annotations

import time
from collections.abc import Callable

import corbot

FAR = [60.0, 0.0, 0.0, 0.0]  # degrees, of the Lynx 5
SLOWLY = 6.0  # seconds


def until(condition: Callable[[], bool], within: float = 20.0) -> None:
    """Return as soon as the condition holds; fail after `within` seconds."""
    end = time.monotonic() + within
    while not condition():
        assert time.monotonic() < end, f"not within {within} s"
        time.sleep(0.002)


def is_at_rest(arm: corbot.Arm) -> bool:
    state = arm.state
    return state.motion is None and state.status is not corbot.Status.WAITING


def runs(motion: corbot.Motion) -> bool:
    return motion.info.state is corbot.MotionState.RUNNING and motion.progress > 0.02
