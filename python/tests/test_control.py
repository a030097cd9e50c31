# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest

import corbot
from corbot import _orb
from support import FAR, SLOWLY, until


def test_control_is_exclusive_within_the_block(arm: corbot.Arm) -> None:
    other = corbot.connect(arm.address)
    with arm.control("Ada"):
        assert other.state.control.holder == "Ada"
        with pytest.raises(corbot.NotReady, match="Ada.*arm.state.control shows"):
            other.ready()
        arm.joints([5, 0, 0, 0])
    assert other.state.control.holder == ""
    other.ready()
    arm.ready()


def test_the_lease_is_renewed_while_the_program_does_something_else(arm: corbot.Arm) -> None:
    begun = time.monotonic()
    with arm.control("Ada", lease=7.0):  # longer than a machine stands still
        until(lambda: time.monotonic() - begun > 8)
        arm.joints([5, 0, 0, 0])


def test_the_end_of_the_block_stops_the_arm(arm: corbot.Arm) -> None:
    with arm.control("Ada"):
        motion = arm.joints(FAR, time=SLOWLY, wait=False)
    assert motion.info.state is corbot.MotionState.STOPPED


def test_an_exception_leaves_the_block_and_control_ends(arm: corbot.Arm) -> None:
    with pytest.raises(ZeroDivisionError), arm.control("Ada"):
        _ = 1 / 0
    assert arm.state.control.holder == ""


def test_the_blocks_own_exception_counts_where_control_had_ended(arm: corbot.Arm) -> None:
    with pytest.raises(ZeroDivisionError), arm.control("Ada") as held:
        held.call("Release")
        _ = 1 / 0
    arm.ready()


def test_ctrl_c_while_control_is_acquired_releases_it(
    arm: corbot.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = _orb.call

    def interrupted(address: str, operation: Callable[..., Any], *arguments: Any) -> Any:
        with _orb.uninterrupted():
            result = original(address, operation, *arguments)
            if operation.__name__ == "Acquire":
                os.kill(os.getpid(), signal.SIGINT)
        return result

    monkeypatch.setattr(_orb, "call", interrupted)
    with pytest.raises(KeyboardInterrupt), arm.control("Ada"):
        raise AssertionError("the block begins only under control")
    monkeypatch.undo()
    with arm.control("Grace"):
        arm.ready()
