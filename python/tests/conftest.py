# SPDX-License-Identifier: Apache-2.0
"""One simulated robot for each file of tests, and its arm at zero for each test."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

import corbot
from corbot.simulation import Simulation

# The project's tests give a profile that does not take a busy machine's gaps for faults.
PROFILE = os.environ.get("CORBOT_TEST_PROFILE", "lynx5")


@pytest.fixture(scope="module")
def robot() -> Iterator[Simulation]:
    with Simulation(PROFILE) as simulation:
        yield simulation


@pytest.fixture
def arm(robot: Simulation) -> Iterator[corbot.Arm]:
    robot.arm.ready()
    yield robot.arm
    robot.arm.stop()
    robot.arm.clear()
