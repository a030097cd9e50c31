# SPDX-License-Identifier: Apache-2.0
"""The programs of examples/python, and the solutions of the exercises."""

from __future__ import annotations

import importlib.util
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import corbot
from corbot.cell import Cell
from corbot.simulation import _free_ports
from support import until

EXAMPLES = Path(__file__).resolve().parents[2] / "examples/python"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(Path(name).name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(name: str, *arguments: str) -> str:
    return subprocess.check_output(
        [sys.executable, str(EXAMPLES / f"{name}.py"), *arguments], text=True, timeout=60
    )


def test_pick_and_place_grips_here_and_opens_there(arm: corbot.Arm) -> None:
    with corbot.record(arm) as recorded:
        run("pick_and_place", arm.address)
    places = load("pick_and_place")
    opening = np.array([state.gripper.commanded for state in recorded._taken])
    held = np.flatnonzero(np.abs(opening - 20) < 0.1)  # from the end of the grip to the opening
    # The arm stands while the fingers move, so a reading more or less makes no difference.
    moves = (opening > 20.1) & (np.abs(np.gradient(opening)) > 0.01)
    closes, opens = moves.copy(), moves.copy()
    closes[held[0] :], opens[: held[-1]] = False, False
    assert recorded.tool[closes][-1] == pytest.approx(places.FROM, abs=1e-3)
    assert recorded.tool[opens][0] == pytest.approx(places.TO, abs=1e-3)
    assert recorded.tool[held][:, 2].max() == pytest.approx(places.FROM[2] + places.ABOVE, abs=0.02)
    assert arm.state.control.holder == ""


def test_the_square_is_drawn_by_lines(arm: corbot.Arm) -> None:
    output = run("square", arm.address)
    found = re.fullmatch(r"The tool was at most (\S+) mm off the square, in \S+ s\.\n", output)
    assert found is not None, output
    assert float(found[1]) < 0.1
    square = load("square")
    drawn = square.draw(arm)
    for corner in square.CORNERS:
        assert np.hypot(*(drawn.tool[:, :2] - corner).T).min() < 0.01, "a late reading is up to 0.3 s away"


def test_two_arms_go_in_step() -> None:
    with ExitStack() as stack:
        arms = [stack.enter_context(corbot.simulated("lynx5")) for _ in range(2)]
        for _ in range(5):
            with corbot.record(arms[0]) as first, corbot.record(arms[1]) as second:
                run("two_arms", *(arm.address for arm in arms))
            times = [[state.time for state in record._taken] for record in (first, second)]
            if all(np.diff(some).max() < 0.3 for some in times):  # else the machine stood still
                break
    begin = max(first._taken[0].time, second._taken[0].time)
    end = min(first._taken[-1].time, second._taken[-1].time)
    when = np.linspace(begin, end, 200)
    base = [
        np.interp(when, [state.time for state in run._taken], run.joints[:, 0]) for run in (first, second)
    ]
    assert base[0].max() == pytest.approx(30, abs=0.5)
    assert base[0].min() == pytest.approx(-30, abs=0.5)
    assert np.abs(base[0] - base[1]).max() < 40, "degrees; one after the other they are 60 apart"


@pytest.fixture
def own_camera(tmp_path: Path) -> Iterator[tuple[Cell, Path]]:
    pieces = tmp_path / "pieces"
    port = _free_ports(1)
    process = subprocess.Popen([sys.executable, str(EXAMPLES / "own_camera.py"), str(pieces), str(port)])
    cell = Cell({"name": "test", "camera": f"corbaloc::127.0.0.1:{port}/Camera", "robots": {}}, 5.0)

    def serves() -> bool:
        try:
            cell.look()
        except corbot.NotReady:
            return True  # without a file
        except (corbot.RobotNotFound, corbot.Disconnected):
            return False
        return True

    until(serves)
    yield cell, pieces
    process.send_signal(signal.SIGINT)
    assert process.wait(10) == 0, "Ctrl-C ends it"


def test_a_camera_of_ones_own_gives_its_pieces(own_camera: tuple[Cell, Path]) -> None:
    cell, pieces = own_camera
    assert len((EXAMPLES / "own_camera.py").read_text().splitlines()) <= 30
    pieces.write_text("red 0.1 0.24\nred 0.08 0.20\n")
    first = cell.look()
    assert [(piece.kind, piece.position) for piece in first.pieces] == [
        ("red", (0.1, 0.24, 0)),
        ("red", (0.08, 0.20, 0)),
    ]
    pieces.write_text("")
    second = cell.look()
    assert second.pieces == ()
    assert second.number > first.number
    assert second.time > first.time
    with pytest.raises(corbot.NotReady, match="takes no pictures"):
        cell.picture()
    with pytest.raises(corbot.BadParameter, match=r"0\.1 to 60 seconds"):
        cell.look(100)
    pieces.unlink()
    with pytest.raises(corbot.NotReady, match="No such file"):
        cell.look()


def test_exercise_1_staircase(arm: corbot.Arm) -> None:
    assert load("exercises/staircase").staircase(arm) == pytest.approx(
        [0.06, 0.07, 0.08, 0.09, 0.10], abs=1e-6
    )


def test_exercise_2_reach(arm: corbot.Arm) -> None:
    reach = load("exercises/reach").reach_along_x(arm)
    arm.move(reach, 0, 0.08)
    with pytest.raises((corbot.Unreachable, corbot.LimitExceeded)):
        arm.move(reach + 0.002, 0, 0.08)


def test_exercise_3_circle(arm: corbot.Arm) -> None:
    assert load("exercises/circle").circle(arm) < 1e-4


def test_exercise_4_interrupted(arm: corbot.Arm) -> None:
    assert 0.0 < load("exercises/interrupted").interrupted(arm) < 1.0
    assert arm.state.joints == pytest.approx((0, 0, 0, 0), abs=1e-3)


def test_exercise_5_other_way(arm: corbot.Arm) -> None:
    arm.joints([10, 50, 20, -20])
    before = arm.state
    solution = load("exercises/other_way").other_way(arm)
    assert solution is not None
    assert arm.state.joints == pytest.approx(solution.joints, abs=1e-3)
    assert arm.state.joints != pytest.approx(before.joints, abs=1)
    assert arm.state.tool.position == pytest.approx(before.tool.position, abs=1e-6)
