# SPDX-License-Identifier: Apache-2.0
"""One simulated robot for each file of tests and each worker, and its arm at zero for each test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

import corbot
from corbot import _orb


@dataclass(frozen=True)
class Robot:
    simulation: corbot.Simulation
    arm: corbot.Arm


def simulation() -> Iterator[Robot]:
    robot = corbot.simulated("lynx5")
    with robot as arm:
        yield Robot(robot, arm)


robot = pytest.fixture(scope="module", name="robot")(simulation)
fresh = pytest.fixture(name="fresh")(simulation)


@pytest.fixture
def arm(robot: Robot) -> Iterator[corbot.Arm]:
    robot.arm.ready()
    yield robot.arm
    robot.arm.stop()
    robot.arm.clear()


@pytest.fixture
def reached(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Give the operations that the package calls from now on."""
    names: set[str] = set()
    original = _orb.call

    def call(address: str, operation: Callable[..., Any], *arguments: Any) -> Any:
        names.add(operation.__name__)
        return original(address, operation, *arguments)

    monkeypatch.setattr(_orb, "call", call)
    return names
