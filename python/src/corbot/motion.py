# SPDX-License-Identifier: Apache-2.0
"""A motion that the robot has accepted."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import time
from collections.abc import Callable, Generator, Iterator
from typing import TYPE_CHECKING, Any

from corbot.errors import MotionTimeout, NotReady, QueueFull, Stopped
from corbot.values import MotionInfo, MotionState, motion_of

if TYPE_CHECKING:
    from corbot.arm import Arm

_SLICE = 0.1  # seconds of one call, the longest delay of Ctrl-C


class Motion:
    """An accepted motion: wait for it, await it, or cancel it.

    Ctrl-C in `wait`, and a cancelled task in `await`, stop the arm.
    """

    def __init__(self, arm: Arm, number: int, ended: MotionInfo | None = None) -> None:
        self._arm, self._ended = arm, ended
        self.number = number
        """The interface's number of the motion, from 1 upward."""

    def wait(self, timeout: float | None = None, *, progress: bool = False) -> MotionInfo:
        """Wait until the motion has ended at its target, at most `timeout` seconds.

        Raises Stopped, NotReady (a fault ended it) or MotionTimeout (it continues). `progress` shows a bar,
        if tqdm is installed.
        """
        with self._arm.stopped_by_interrupt(), _bar(f"motion {self.number}", progress) as show:
            return self._wait(timeout, show)

    @property
    def info(self) -> MotionInfo:
        """The present state of the motion."""
        return self._ended or motion_of(self._arm.call("Progress", self.number))

    @property
    def progress(self) -> float:
        """The elapsed part of its time, 0 to 1."""
        return self.info.progress

    @property
    def duration(self) -> float:
        """The planned seconds at override 100 %; more than `time` if the limits require it."""
        return self.info.duration

    def cancel(self) -> None:
        """Cancel the motion and all motions queued behind it; returns when they have ended."""
        self._arm.call("Cancel", self.number)

    def __await__(self) -> Generator[Any, None, MotionInfo]:
        return self._await().__await__()

    def __repr__(self) -> str:
        return f"<Motion {self.number} of {self._arm.address}>"

    def _wait(self, timeout: float | None, show: Callable[[float], None]) -> MotionInfo:
        end = float("inf") if timeout is None else time.monotonic() + timeout
        while True:
            info = self._look(max(0.0, min(_SLICE, end - time.monotonic())))
            show(info.progress)
            if info.state.has_ended:
                return _at_target(info)
            if timeout is not None and time.monotonic() >= end:
                raise MotionTimeout(self.number, timeout)

    async def _await(self) -> MotionInfo:
        try:
            while True:
                info = await asyncio.to_thread(self._look, _SLICE)
                if info.state.has_ended:
                    return _at_target(info)
        except asyncio.CancelledError as error:
            self._arm.stop_because_of(error)
            raise

    def _look(self, seconds: float) -> MotionInfo:
        """Wait for a slice; if too many calls of this machine wait already, poll after it."""
        try:
            return self._ended or motion_of(self._arm.call("Wait", self.number, seconds))
        except QueueFull:
            time.sleep(seconds)
            return self.info


@contextlib.contextmanager
def _bar(title: str, wanted: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that shows a share of 0 to 1 on a bar of tqdm.

    It does nothing if not wanted, or not installed.
    """
    if not wanted or importlib.util.find_spec("tqdm") is None:
        yield lambda share: None
        return
    from tqdm.auto import tqdm

    with tqdm(total=1.0, desc=title, bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}") as bar:
        yield lambda share: bar.update(share - bar.n)


def _at_target(info: MotionInfo) -> MotionInfo:
    if info.state is MotionState.STOPPED:
        raise Stopped(info.reason)
    if info.state is MotionState.FAILED:
        raise NotReady(info.reason)
    return info
