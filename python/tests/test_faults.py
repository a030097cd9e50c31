# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import contextlib
import os
import signal
import time

import pytest

import corbot
from conftest import Robot
from support import FAR, SLOWLY, freeze, is_at_rest, runs, until


def test_a_killed_servant_ends_a_wait_and_is_back_soon(fresh: Robot) -> None:
    arm = fresh.arm
    motion = arm.joints(FAR, time=SLOWLY, wait=False)
    until(lambda: runs(motion))
    begun = time.monotonic()
    os.kill(fresh.simulation.processes["servant_pid"], signal.SIGKILL)
    with pytest.raises(corbot.Disconnected, match=r"still ends at rest.*read arm\.state") as raised:
        motion.wait()
    assert time.monotonic() - begun < SLOWLY / 2
    assert raised.value.address == arm.address

    def is_back_at_rest() -> bool:
        with contextlib.suppress(corbot.CorbotError):
            return is_at_rest(arm)
        return False

    until(is_back_at_rest)
    arm.ready()


def test_a_frozen_servant_ends_a_call_in_time(fresh: Robot) -> None:
    arm = corbot.connect(fresh.arm.address, timeout=0.5)
    servant = fresh.simulation.processes["servant_pid"]
    freeze(servant)
    try:
        begun = time.monotonic()
        with pytest.raises(corbot.NoAnswer, match="may still be carried out"):
            _ = arm.state
        assert 0.4 < time.monotonic() - begun < 5
    finally:
        os.kill(servant, signal.SIGCONT)


def test_a_killed_real_time_task_fails_the_motion(fresh: Robot) -> None:
    arm = fresh.arm
    motion = arm.joints(FAR, time=SLOWLY, wait=False)
    until(lambda: runs(motion))
    os.kill(fresh.simulation.processes["rt_pid"], signal.SIGKILL)
    begun = time.monotonic()
    with pytest.raises(corbot.NotReady) as raised:
        motion.wait()
    assert time.monotonic() - begun < SLOWLY / 2
    assert raised.value.reason


def test_a_stop_that_failed_is_told_beside_the_blocks_exception(fresh: Robot) -> None:
    arm = corbot.connect(fresh.arm.address, timeout=0.5)
    servant = fresh.simulation.processes["servant_pid"]

    def fail() -> None:
        with pytest.raises(ZeroDivisionError), arm:
            freeze(servant)
            _ = 1 / 0

    with pytest.warns(RuntimeWarning, match="may still move"):
        fail()
    os.kill(servant, signal.SIGCONT)
