# SPDX-License-Identifier: Apache-2.0
"""A robot that has the interface of robot.idl alone."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import pytest

import corbot
from corbot.simulation import _free_ports


@pytest.fixture(name="served")
def serve() -> Iterator[tuple[str, IO[str]]]:
    """Give its address and its output."""
    port = _free_ports(1)
    program = str(Path(__file__).with_name("plain_robot.py"))
    with subprocess.Popen([sys.executable, program, str(port)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "serves\n"
        yield f"127.0.0.1:{port}/plain", process.stdout
        process.kill()


def test_it_moves_and_what_it_lacks_is_named(served: tuple[str, IO[str]]) -> None:
    arm = corbot.connect(served[0], timeout=0.2)  # of a call, not of a motion
    motion = arm.move(0.2, 0, 0.1, time=0.5)
    assert motion.wait().state is corbot.MotionState.DONE
    assert motion.duration >= 0.5
    assert arm.call("_get_ArtiCoord") == [0.2]
    with pytest.raises(corbot.Unreachable, match="Too far"):
        arm.move(2, 0, 0.1)
    with pytest.raises(TypeError, match="does not take"):
        arm.drive(2**40, 1, speed=1)
    with pytest.raises(corbot.NotOffered, match="robot.idl alone, without State") as raised:
        _ = arm.state
    assert raised.value.operation == "_get_State"
    for call in (lambda: arm.joints([0]), lambda: arm.move(0.2, 0, 0.1, wait=False), arm.stop):
        with pytest.raises(corbot.NotOffered):
            call()


def test_ctrl_c_waits_for_the_end_of_its_motion(served: tuple[str, IO[str]]) -> None:
    address, output = served
    program = f"import corbot\ncorbot.connect({address!r}).move(0.3, 0, 0.1, time=1.5)"
    with subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True) as child:
        assert output.readline() == "begins\n"
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=20)
    assert output.readline() == "ends\n"
    assert corbot.connect(address).call("_get_ArtiCoord") == [0.3]
    assert "This robot has no Stop: its motion is awaited." in errors
    assert errors.endswith("KeyboardInterrupt\n")


def test_ctrl_c_while_a_motion_is_prepared_begins_nothing(
    served: tuple[str, IO[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    address, output = served
    arm = corbot.connect(address)
    start = threading.Thread.start

    def interrupted(thread: threading.Thread) -> None:
        start(thread)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", interrupted)
        with pytest.raises(KeyboardInterrupt):
            arm.move(0.3, 0, 0.1)
    arm.move(0.2, 0, 0.1)
    assert arm.call("_get_ArtiCoord") == [0.2]
    with pytest.raises(corbot.CorbotError):
        arm.move(-1, 0, 0)  # on which it ends
    assert output.read() == "begins\nends\n", "of the second motion alone"


def test_a_second_ctrl_c_leaves_it_moving(served: tuple[str, IO[str]]) -> None:
    address, output = served
    program = f"import corbot\ncorbot.connect({address!r}).move(0.3, 0, 0.1, time=60)"
    with subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True) as child:
        assert output.readline() == "begins\n"
        child.send_signal(signal.SIGINT)
        assert child.stderr is not None
        assert "Ctrl-C again leaves it moving" in child.stderr.readline()
        child.send_signal(signal.SIGINT)
        assert child.communicate(timeout=20)[1].endswith("KeyboardInterrupt\n")


def test_ctrl_c_that_ends_no_wait_of_the_main_thread_counts(
    served: tuple[str, IO[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such is a signal just before the wait begins, and one that another thread receives."""
    address, output = served
    warned = threading.Event()
    monkeypatch.setattr(warnings, "warn", lambda *_, **__: warned.set())

    def interrupt_twice() -> None:
        assert output.readline() == "begins\n"
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)
        if warned.wait(20):
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)

    interrupts = threading.Thread(target=interrupt_twice)
    interrupts.start()
    arm = corbot.connect(address)
    with pytest.raises(KeyboardInterrupt):
        arm.move(0.3, 0, 0.1, time=30)
    interrupts.join()
    assert warned.is_set()
    assert arm.call("_get_ArtiCoord") == [0.0], "the end of the motion is not awaited"


def test_a_robot_that_dies_ends_its_motion(served: tuple[str, IO[str]]) -> None:
    arm = corbot.connect(served[0])
    with pytest.raises(corbot.Disconnected):
        arm.move(-1, 0, 0.1)
