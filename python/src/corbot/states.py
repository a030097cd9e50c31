# SPDX-License-Identifier: Apache-2.0
"""A stream of readings at a fixed rate."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator

from corbot.values import State


class States(Iterator[State]):
    """An iterator over the arm's state, until `end`. It drops late readings, so each reading is new."""

    def __init__(self, read: Callable[[], State], rate: float) -> None:
        if not 0.0 < rate <= 1000.0:
            raise ValueError(f"A rate is above 0 and at most 1000 readings a second, not {rate:g}.")
        self._read, self._period = read, 1.0 / rate
        self._begin: float | None = None
        self._ended = threading.Event()
        self._next = 0  # number of the next instant
        self.dropped = 0
        """The readings that were left out so far, since the caller or the servant was late."""

    def end(self) -> None:
        """End the iteration; any thread may call this."""
        self._ended.set()

    def __next__(self) -> State:
        now = time.monotonic()
        if self._begin is None:
            self._begin = now
        behind = math.floor((now - self._begin) / self._period) - self._next
        if behind > 0:  # instants that have passed; the latest of them is read now
            self.dropped += behind
            self._next += behind
        if self._ended.wait(max(0.0, self._begin + self._next * self._period - now)):
            raise StopIteration
        self._next += 1
        return self._read()
