# SPDX-License-Identifier: Apache-2.0
"""Runs each kind of call in a program of its own.

Meanwhile its servant dies, its task freezes, its device goes, or Ctrl-C comes.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

import corbot
from corbot.simulation import Simulation, find_program
from support import FAR, SLOWLY, freeze, is_at_rest, until

END = 15.0  # seconds, from the fault to the end of the program, on a busy machine
CALLS = {
    "motion": "    arm.joints([0, 0, 0, 0])",
    "await": (
        "    import asyncio\n    async def main():\n"
        "        await arm.ready(wait=False)\n    asyncio.run(main())"
    ),
    "control": f"    arm.stop()\n    with arm.control('Ada'):\n        arm.joints({FAR}, time={SLOWLY})",
    "description": "    while True:\n        corbot.connect(arm.address).description",
    "solutions": "    while True:\n        arm.solutions(pose)",
    "states": "    for state in arm.states(50):\n        pass",
    "record": "    with corbot.record(arm):\n        arm.joints([0, 0, 0, 0])",
    "settings": "    while True:\n        arm.set_speeds(tool=50)",
}
NEEDS_THE_TASK = {"motion", "await", "control", "record"}


def signal_to(process: str, number: int) -> Callable[[Simulation], None]:
    return lambda simulation: os.kill(simulation.processes[process], number)


FAULTS: dict[str, Callable[[Simulation], None]] = {
    "killed servant": signal_to("servant_pid", signal.SIGKILL),
    "frozen task": lambda simulation: freeze(simulation.processes["rt_pid"]),
    "unplugged device": signal_to(
        "rt_pid", signal.SIGUSR1
    ),  # which the simulated device has instead of a plug
    "Ctrl-C": lambda simulation: None,
}


@pytest.fixture
def simulation() -> Iterator[Simulation]:
    simulation = corbot.simulated("lynx5")
    with simulation:
        yield simulation


@contextlib.contextmanager
def running(program: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    child = subprocess.Popen([sys.executable, "-c", program, *arguments], stderr=subprocess.PIPE, text=True)
    try:
        yield child
    finally:
        child.kill()
        child.wait()


def last_line(child: subprocess.Popen[str]) -> str:
    """The exception with which the program ends, in time."""
    _, errors = child.communicate(timeout=END)
    assert child.returncode != 0
    assert "Traceback" in errors
    return errors.rstrip().rsplit("\n", 1)[-1]


def stands_still(address: str) -> bool:
    """Without a look at what the servant says: two readings are equal."""
    with contextlib.suppress(corbot.CorbotError):
        arm = corbot.connect(address)
        before = arm.state.commanded
        time.sleep(0.1)
        return arm.state.commanded == before
    return False


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("fault", FAULTS)
def test_each_call_ends_as_it_should(fault: str, call: str, simulation: Simulation) -> None:
    address = simulation.processes["address"]
    arm = corbot.connect(address)
    begin = "import sys, corbot\narm = corbot.connect(sys.argv[1])\npose = arm.state.tool\nwith arm:\n"
    with running(
        f"{begin}    arm.joints({FAR}, time={SLOWLY}, wait=False)\n{CALLS[call]}\n", address
    ) as child:
        until(lambda: arm.state.joints[0] > 1.0)
        FAULTS[fault](simulation)
        goes_on = fault in ("frozen task", "unplugged device") and call not in NEEDS_THE_TASK
        if goes_on or fault == "Ctrl-C":
            if goes_on:
                until(lambda: arm.state.status is corbot.Status.ERROR, within=END)
            assert child.poll() is None, "it goes on: it does not need the task"
            child.send_signal(signal.SIGINT)
            assert last_line(child).startswith("KeyboardInterrupt")
        elif fault == "killed servant":
            assert last_line(child).startswith(
                ("corbot.errors.Disconnected: ", "corbot.errors.RobotNotFound: ")
            )
        else:
            assert last_line(child).startswith("corbot.errors.NotReady: ")
    until(lambda: stands_still(address), within=SLOWLY + END)
    if fault == "frozen task":
        with contextlib.suppress(ProcessLookupError):  # on a busy machine `corbot up` has replaced it by now
            os.kill(simulation.processes["rt_pid"], signal.SIGCONT)
    elif fault == "Ctrl-C":
        assert is_at_rest(arm)
        assert arm.state.joints[0] < FAR[0] - 1, "the arm stands on its way"


needs_a_cell = pytest.mark.skipif(
    not (find_program().parent / "corbot-scene").exists(),
    reason="corbot was built without OpenCV, SQLite or libturbojpeg",
)
CELL_CALLS = {
    "watch": "for event in cell.watch():\n    pass",
    "look": "while True:\n    cell.look()",
    "robots": "while True:\n    cell.robots",
    "pieces": "while True:\n    cell.pieces",
}


@needs_a_cell
def test_ctrl_c_in_a_call_of_a_cell_ends_the_program_and_not_the_cell() -> None:
    with (simulation := corbot.simulated_cell(pieces=2)) as cell:
        cell.pause()
        for call in CELL_CALLS.values():
            begin = (
                "import sys, pathlib, corbot\n"
                "cell = corbot.cell(pathlib.Path(sys.argv[1]))\nprint(cell, file=sys.stderr)\n"
            )
            with running(begin + call, str(simulation.directory / "cell")) as child:
                assert child.stderr is not None
                child.stderr.readline()  # it has found the cell
                time.sleep(0.2)
                child.send_signal(signal.SIGINT)
                assert last_line(child) == "KeyboardInterrupt"
        assert cell.is_paused
        assert cell.is_running


@needs_a_cell
def test_a_call_of_a_cell_that_was_killed_says_so() -> None:
    simulation = corbot.simulated_cell(pieces=2)
    with simulation as cell:
        assert cell.robots
        assert cell.pieces is not None
        assert cell.look()
        assert simulation._process is not None
        os.kill(simulation._process.pid, signal.SIGKILL)  # its programs end with it
        begun = time.monotonic()
        for call in (lambda: cell.robots, lambda: cell.pieces, cell.look, cell.pause):
            with pytest.raises(corbot.Disconnected):
                while time.monotonic() < begun + END:
                    call()
        with pytest.raises((corbot.Disconnected, corbot.RobotNotFound, corbot.NotReady)) as stopped:
            cell.stop()
        if stopped.type is corbot.NotReady:
            assert "shutting down" in str(stopped.value), "by a robot that is just ending"
        assert list(cell.watch()) == [], "it ends with the cell"
