# SPDX-License-Identifier: Apache-2.0
"""The pick-and-place cell: pieces, robots, events. Metres, degrees and seconds, in the world frame."""

from __future__ import annotations

import contextlib
import enum
import fcntl
import json
import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from corbot import _orb
from corbot.arm import Arm, connect
from corbot.errors import CellNotFound, Disconnected, RobotNotFound
from corbot.poses import Point

_INTERFACES = {
    "store": _orb.Corbot.Store,
    "camera": _orb.Corbot.Camera,
    "coordinator": _orb.Corbot.Coordinator,
}


class Step(enum.Enum):
    """A step of a robot's work on a piece."""

    RESERVED = "StepReserved"
    PICKING = "StepPicking"
    HELD = "StepHeld"
    PLACING = "StepPlacing"
    PLACED = "StepPlaced"
    WITHDRAWN = "StepWithdrawn"
    UNCLEAR = "StepUnclear"
    GONE = "StepGone"
    """A person must say where the piece is."""


class Work(enum.Enum):
    """The present activity of a robot of the cell."""

    IDLE = "WorkIdle"
    WAITING = "WorkWaiting"
    MOVING = "WorkMoving"
    STOPPED = "WorkStopped"
    """A stop of another client ended a motion."""
    ATTENTION = "WorkAttention"
    """A person has to do something first."""


@dataclass(frozen=True)
class Spot:
    """The position of a piece.

    It has a place, its slot from 0 (None in an area), the middle of the foot, and the rotation about z.
    """

    place: str
    slot: int | None
    position: Point
    yaw: float


@dataclass(frozen=True)
class PieceEvent:
    """One line of the ledger's history.

    Numbers begin at 1 and have no gaps; `time` is in seconds since the Unix epoch.
    """

    number: int
    time: float
    piece: int
    kind: str
    robot: str
    step: Step
    where: Spot
    note: str


@dataclass(frozen=True)
class Place:
    """A place of the cell.

    `capacity` is its number of slots, 0 for an area; `robot` is the robot in its zone, or empty.
    """

    name: str
    capacity: int
    pieces: int
    reserved: int
    shared: bool
    robot: str


@dataclass(frozen=True)
class RobotWork:
    """The activity of a robot, its piece (None: none), its beginning (Unix epoch), and why it waits."""

    robot: str
    work: Work
    piece: int | None
    since: float
    text: str


@dataclass(frozen=True)
class Sighting:
    """A piece in a picture: the middle of its foot, its rotation about z, and the confidence, 0 to 1."""

    kind: str
    position: Point
    yaw: float = 0.0
    confidence: float = 1.0


@dataclass(frozen=True)
class Frame:
    """The findings in one picture; `time` is the middle of the exposure, seconds since the Unix epoch."""

    number: int
    time: float
    pieces: tuple[Sighting, ...]


def cell(name: str | Path = "demo", *, timeout: float = 10.0) -> Cell:
    """Find a cell that runs on this machine, by its name or its state directory.

    `timeout` bounds each call, seconds.
    """
    directory = (
        Path(name) if isinstance(name, Path) or os.sep in name else _state_directory() / "cells" / str(name)
    )
    addresses = _read(directory)
    if addresses is None:
        raise CellNotFound(str(name), str(directory))
    return Cell(addresses, timeout)


class Cell:
    """A running cell: monitor it, start its work, pause it, stop it."""

    def __init__(self, addresses: dict[str, Any], timeout: float) -> None:
        self._addresses, self._timeout = addresses, timeout
        self._references: dict[str, Any] = {}
        self.name: str = addresses["name"]

    def __repr__(self) -> str:
        return f"<Cell {self.name} with {', '.join(self._addresses['robots'])}>"

    @cached_property
    def arms(self) -> dict[str, Arm]:
        """The arms of the robots, by the robots' names."""
        return {
            name: connect(address, timeout=self._timeout)
            for name, address in self._addresses["robots"].items()
        }

    # Watching

    @property
    def robots(self) -> dict[str, RobotWork]:
        """The activity of each robot, by its name."""
        return {
            work.robot: RobotWork(
                work.robot, Work(str(work.state)), work.piece or None, work.since, work.text
            )
            for work in self._call("coordinator", "_get_State").robots
        }

    @property
    def is_running(self) -> bool:
        """Whether the work has begun and not ended."""
        return str(self._call("coordinator", "_get_State").mode) == "CellRunning"

    @property
    def placed(self) -> int:
        """The number of pieces at places from which no robot takes."""
        return int(self._call("coordinator", "_get_State").placed)

    @property
    def places(self) -> dict[str, Place]:
        """The places, by their names."""
        return {
            place.name: Place(
                place.name, place.capacity, place.pieces, place.reserved, bool(place.shared), place.robot
            )
            for place in self._call("store", "_get_Places")
        }

    @property
    def pieces(self) -> dict[int, PieceEvent]:
        """The last event of each piece that a robot has reserved, by the piece's number."""
        return {event.piece: event for event in self.events()}

    def events(self, after: int = 0) -> list[PieceEvent]:
        """Give the ledger's events after that number, oldest first."""
        events: list[PieceEvent] = []
        while page := self._call("store", "History", 0, events[-1].number if events else after):
            events += map(_event_of, page)
        return events

    def watch(self, after: int = 0, *, every: float = 0.2) -> Iterator[PieceEvent]:
        """Give each new event, polled every `every` seconds. Ends when the cell has ended."""
        with contextlib.suppress(Disconnected, RobotNotFound):
            while True:
                for event in self.events(after):
                    after = event.number
                    yield event
                time.sleep(every)

    def look(self, timeout: float = 5.0) -> Frame:
        """Take a picture with the camera, within `timeout` seconds, and give the pieces in it."""
        frame = self._call("camera", "Look", float(timeout))
        return Frame(frame.number, frame.time, tuple(map(_sighting_of, frame.pieces)))

    def picture(self, *, marked: bool = False) -> bytes:
        """Give the camera's last picture as a JPEG file; `marked`: with the findings drawn in."""
        return bytes(self._call("camera", "Picture", marked))

    # Working

    def start(self) -> None:
        """Begin the work of every robot; no effect if it has begun."""
        self._call("coordinator", "Start")

    def pause(self) -> None:
        """Prevent new motions until `resume`; returns at once. A motion in progress continues to its end."""
        self._call("coordinator", "Pause")

    def resume(self) -> None:
        """Continue after `pause`."""
        self._call("coordinator", "Resume")

    @property
    def is_paused(self) -> bool:
        """Whether a `pause` is in force."""
        return bool(self._call("coordinator", "_get_Paused"))

    def stop(self) -> None:
        """Stop all arms; returns when they are at rest.

        The work ends, and with it the cell that `corbot cell run` started. It stops every arm that it can
        reach, and then raises the first failure.
        """
        addresses: list[str] = list(self._addresses["robots"].values())
        with ThreadPoolExecutor(len(addresses)) as pool:
            stops = [
                pool.submit(lambda address: connect(address, timeout=self._timeout).stop(), each)
                for each in addresses
            ]
        for stop in stops:
            stop.result()

    def _call(self, part: str, operation: str, *arguments: Any) -> Any:
        if part not in self._references:
            self._references[part] = _orb.connect(self._addresses[part], self._timeout, _INTERFACES[part])
        return _orb.call(self._addresses[part], getattr(self._references[part], operation), *arguments)


def _state_directory() -> Path:
    for variable, below in (("CORBOT_STATE_DIR", ""), ("XDG_STATE_HOME", "corbot")):
        directory = os.environ.get(variable, "")
        if directory.startswith("/"):  # a relative path is ignored, like in corbot
            return Path(directory) / below
    return Path.home() / ".local/state/corbot"


def _read(directory: Path) -> dict[str, Any] | None:
    """Read the addresses of a cell; None if no `corbot cell run` holds the lock of the directory."""
    try:
        with open(directory / "lock", "rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        with contextlib.suppress(OSError, ValueError):
            addresses: dict[str, Any] = json.loads((directory / "cell.json").read_text(encoding="utf-8"))
            return addresses
    except OSError:
        pass
    return None


def _event_of(event: Any) -> PieceEvent:
    where = event.where
    position = Point(where.position.x, where.position.y, where.position.z)
    spot = Spot(where.place, where.slot if where.slot >= 0 else None, position, where.yaw)
    return PieceEvent(
        event.number,
        event.time,
        event.piece,
        event.kind,
        event.robot,
        Step(str(event.step)),
        spot,
        event.note,
    )


def _sighting_of(sighting: Any) -> Sighting:
    p = sighting.position
    return Sighting(sighting.kind, Point(p.x, p.y, p.z), sighting.yaw, sighting.confidence)
