# SPDX-License-Identifier: Apache-2.0
"""Functions that several tests share."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import corbot
from corbot.simulation import Simulation, _free_ports, find_program

FAR = [60.0, 0.0, 0.0, 0.0]  # degrees, of the Lynx 5
SLOWLY = 6.0  # seconds


def until(condition: Callable[[], bool], within: float = 60.0) -> None:
    """Return soon after the condition holds; fail after `within` seconds.

    The pauses grow: tests that look without a pause would starve the process for which they wait.
    """
    end = time.monotonic() + within
    pause = 0.002
    while not condition():
        assert time.monotonic() < end, f"not within {within} s"
        time.sleep(pause)
        pause = min(1.5 * pause, 0.03)


def freeze(process: int) -> None:
    """Stop a process by SIGSTOP, and return when each of its threads has stopped."""
    os.kill(process, signal.SIGSTOP)
    threads = Path(f"/proc/{process}/task")
    until(lambda: all(_state_of(thread) == "T" for thread in threads.iterdir()))


def _state_of(thread: Path) -> str:
    """Give the letter after the name in parentheses, which may have spaces."""
    return (thread / "stat").read_text().rpartition(")")[2].split()[0]


def is_at_rest(arm: corbot.Arm) -> bool:
    state = arm.state
    return state.motion is None and state.status is not corbot.Status.WAITING


def runs(motion: corbot.Motion) -> bool:
    return motion.info.state is corbot.MotionState.RUNNING and motion.progress > 0.02


def skip_without(orb: str) -> None:
    """Skip a test for which this build has no servant."""
    if orb == "orbit2" and not (find_program().parent / "corbot-servant-orbit2").exists():
        pytest.skip("corbot was built without ORBit2")


class _WithNaming(Simulation):
    def _command(self, directory: Path) -> list[str]:
        return [*super()._command(directory), "--naming", str(_free_ports(1))]


def simulated_with_naming(orb: str = "omniorb") -> Simulation:
    """Give a Lynx 5 with a naming service, whose reference is `processes["naming"]`."""
    if not shutil.which("omniNames"):
        pytest.skip("omniNames is not installed")
    return _WithNaming("lynx5", orb)
