# SPDX-License-Identifier: Apache-2.0
"""A simulated cell, watched, paused and stopped."""

from __future__ import annotations

import contextlib
import subprocess
import time
from itertools import islice
from pathlib import Path

import pytest

import corbot
from corbot import Step
from corbot.simulation import find_program
from support import is_at_rest, until

needs_a_cell = pytest.mark.skipif(
    not (find_program().parent / "corbot-scene").exists(),
    reason="corbot was built without OpenCV, SQLite or libturbojpeg",
)


@needs_a_cell
def test_a_cell_is_watched_until_its_work_is_done() -> None:
    simulation = corbot.simulated_cell(pieces=2)
    with simulation as cell:
        assert list(cell.arms) == ["robot1", "robot2"]
        assert cell.places["store1"].capacity == 4
        assert cell.places["store1"].shared
        events = list(cell.watch())
        assert simulation.wait(60) == 0, simulation.output
    assert [event.number for event in events] == list(range(1, len(events) + 1))
    assert {
        event.piece for event in events if event.step is Step.PLACED and event.where.place == "pallet2"
    } == {1, 2}
    first = next(event for event in events if event.step is Step.HELD)
    assert first.robot == "robot1"
    assert first.where.slot is None, "an area has no slots"
    with pytest.raises(corbot.CellNotFound, match="corbot cell run"):
        corbot.cell(simulation.directory / "cell")


@needs_a_cell
def test_a_cell_is_paused_and_stopped() -> None:
    simulation = corbot.simulated_cell(pieces=2)
    with simulation as cell:
        cell.start()  # it works already
        assert cell.is_running
        list(islice(cell.watch(), 2))
        cell.pause()
        assert cell.is_paused
        until(lambda: all(is_at_rest(arm) for arm in cell.arms.values()))
        before = {name: arm.state.joints for name, arm in cell.arms.items()}
        time.sleep(0.5)
        assert {name: arm.state.joints for name, arm in cell.arms.items()} == before
        assert cell.pieces[1].robot == "robot1"
        assert cell.placed == 0
        frame = cell.look()
        assert {sighting.kind for sighting in frame.pieces} == {"red"}
        assert cell.picture()[:2] == b"\xff\xd8", "a JPEG file begins so"
        cell.resume()
        assert not cell.is_paused
        cell._addresses["robots"] = {"gone": "127.0.0.1:1/gone", **cell._addresses["robots"]}
        with pytest.raises(corbot.RobotNotFound):
            cell.stop()  # it stops the others all the same

        for _ in range(20):  # a stop between two motions stops none
            with contextlib.suppress(subprocess.TimeoutExpired):
                simulation.wait(1)
                break
            with contextlib.suppress(corbot.CorbotError):
                cell.stop()
        assert simulation.wait(20) == 4, simulation.output


def test_a_cell_that_does_not_run_is_answered_with_where_it_was_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CORBOT_STATE_DIR", str(tmp_path))
    with pytest.raises(corbot.CellNotFound, match="corbot cell run") as raised:
        corbot.cell("demo")
    assert raised.value.where == str(tmp_path / "cells/demo")
