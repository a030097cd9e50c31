# SPDX-License-Identifier: Apache-2.0
"""The fixture `simulated_arm`, which pytest discovers if corbot is installed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from corbot.arm import Arm


@pytest.fixture
def simulated_arm(request: pytest.FixtureRequest) -> Iterator[Arm]:
    """Give the arm of a fresh simulated Lynx 5, or of the profile in an `indirect` parametrization."""
    from corbot.simulation import simulated  # not before coverage has begun, and only if it is used

    with simulated(getattr(request, "param", "lynx5")) as arm:
        yield arm
