# SPDX-License-Identifier: Apache-2.0
"""The exceptions of this package. Each has the interface's fields, and its text says what to do."""

from __future__ import annotations

import re
from typing import Any

from corbot.poses import Point

_NOTHING_MOVED = "Nothing moved."


def _sentence(reason: str) -> str:
    """Give the servant's reason as a sentence. Argument names, such as Px, begin with a capital already."""
    reason = reason.rstrip(". ")
    return f"{reason[0].upper()}{reason[1:]}." if reason else ""


class CorbotError(Exception):
    """The base of all exceptions of this package."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Allow pickling for process pools, as the arguments of an exception are not those of its class."""
        return (_restored, (type(self), self.args, self.__dict__))


def _restored(kind: type[CorbotError], arguments: tuple[Any, ...], fields: dict[str, Any]) -> CorbotError:
    error = kind.__new__(kind)
    error.args = arguments
    error.__dict__.update(fields)
    return error


class BadParameter(CorbotError, ValueError):
    """A value that no robot could take. `parameter` is the interface's name of the argument."""

    def __init__(self, parameter: str, value: float, reason: str) -> None:
        self.parameter, self.value, self.reason = parameter, value, reason
        text = (
            reason
            if re.search(rf"\b{re.escape(parameter)}\b", reason)
            else f"{parameter} = {value:g}: {reason}"
        )
        super().__init__(f"{_sentence(text)} {_NOTHING_MOVED} Correct the argument.")


class Unreachable(CorbotError):
    """A point outside the workspace: `target`, base frame, metres."""

    def __init__(self, target: Point, reason: str) -> None:
        self.target, self.reason = target, reason
        super().__init__(
            f"{_sentence(reason)} {_NOTHING_MOVED} Choose a point that the arm can reach; 20 cm is 0.20."
        )


class LimitExceeded(CorbotError):
    """A motion that would exceed a limit of `quantity`.

    `joint` counts from 0, and is -1 if the limit is of no joint. `value`, `lower` and `upper` are in degrees
    (metres for a sliding joint), or in these a second; for a duration, in seconds. `unit` names the unit, and
    is empty if it is not known. If the motion leaves the workspace, `quantity` is "workspace: " and a text,
    and the numbers are clearances in metres.
    """

    def __init__(
        self, quantity: str, joint: int, value: float, lower: float, upper: float, unit: str = ""
    ) -> None:
        self.quantity, self.joint, self.value, self.lower, self.upper = quantity, joint, value, lower, upper
        if quantity.startswith("workspace: "):
            self.unit = "m"
            reason = _sentence(quantity.removeprefix("workspace: "))
            super().__init__(f"{reason} {_NOTHING_MOVED}")
            return
        self.unit = unit or ("s" if quantity == "duration" else "")
        of = f" of joint {joint}" if joint >= 0 else ""
        limits = f"{lower:g} to {upper:g} {self.unit}".rstrip()
        super().__init__(
            f"{quantity}{of}: {value:g} is not within {limits}. {_NOTHING_MOVED} Stay within the limits."
        )


class NotReady(CorbotError):
    """The robot is in Error, or another client has control of it; `reason` gives the cause."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        remedy = (
            "arm.state.control shows the client and the time it has left."
            if "' has control of the arm, for" in reason
            else "See arm.state and arm.alarms; arm.clear() leaves Error once its cause is gone."
        )
        super().__init__(f"{_sentence(reason)} {remedy}")


class Stopped(CorbotError):
    """A Stop or a Cancel ended the motion before its target."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(
            f"{_sentence(reason) or 'The motion was stopped.'} "
            "Read arm.state before you move on: the arm is short of the target."
        )


class QueueFull(CorbotError):
    """Too many motions or calls are pending: `capacity` is the limit."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        super().__init__(
            f"{capacity} motions or calls wait already. {_NOTHING_MOVED} Try again when one has ended."
        )


class NoControl(CorbotError):
    """Another client has exclusive control, or the caller's own control has ended (`has_ended`)."""

    def __init__(self, has_ended: bool) -> None:
        self.has_ended = has_ended
        text = (
            "Your control of the arm has ended."
            if has_ended
            else "Another client has exclusive control of the arm."
        )
        super().__init__(
            f"{text} Nothing was changed. See arm.state.control, and take control with arm.control(NAME)."
        )


class NotOffered(CorbotError, NotImplementedError):
    """The robot at `address` has only the interface of robot.idl, without `operation`."""

    def __init__(self, address: str, operation: str) -> None:
        self.address, self.operation = address, operation
        super().__init__(
            f"The robot at {address} has the interface of robot.idl alone, "
            f"without {operation.removeprefix('_get_')}. "
            "It has motions that are awaited, and arm.call reads what it has: arm.call('_get_ArtiCoord')."
        )


class RobotNotFound(CorbotError, ConnectionError):
    """No robot was found. `looked_for` is the name or address; `where` describes what was found instead."""

    def __init__(self, looked_for: str, where: str, several: bool = False) -> None:
        self.looked_for, self.where = looked_for, where
        begin = (
            f"No robot at '{looked_for}'"
            if looked_for
            else "Several robots are up"
            if several
            else "No robot is up"
        )
        end = (
            "Give the name of one: connect(NAME)"
            if several
            else "Start one with 'corbot up PROFILE', or give HOST:PORT/NAME"
        )
        super().__init__(f"{begin}: {where}. {end}.")


class CellNotFound(CorbotError, ConnectionError):
    """No cell of that name runs.

    `looked_for` is the name or directory; `where` is the directory of the search.
    """

    def __init__(self, looked_for: str, where: str) -> None:
        self.looked_for, self.where = looked_for, where
        super().__init__(
            f"No cell '{looked_for}' runs: looked in {where}. Start one with 'corbot cell run CELL', "
            "or give the directory of its --state-dir."
        )


class BadAddress(CorbotError, ValueError):
    """A text that is neither the name of a robot nor an address."""

    def __init__(self, address: str) -> None:
        self.address = address
        super().__init__(
            f"'{address}' is not the address of a robot. "
            "Write the name of one that is up here, HOST:PORT/NAME, "
            "corbaloc::HOST:PORT/NAME, a corbaname or an IOR."
        )


class Disconnected(CorbotError, ConnectionError):
    """The servant at `address` has ended, or closed the connection."""

    def __init__(self, address: str) -> None:
        self.address = address
        super().__init__(
            f"The servant at {address} is gone. An accepted motion still ends at rest. "
            "Call again in a moment, and read arm.state before you move on."
        )


class NoAnswer(CorbotError, TimeoutError):
    """The servant at `address` did not answer in time."""

    def __init__(self, address: str) -> None:
        self.address = address
        super().__init__(
            f"{address} did not answer in time. The operation may still be carried out. "
            "Look at the arm, then at the machine and the network; "
            "connect(..., timeout=SECONDS) waits longer."
        )


class MotionTimeout(CorbotError, TimeoutError):
    """The motion `number` has not ended within `timeout` seconds; it continues."""

    def __init__(self, number: int, timeout: float) -> None:
        self.number, self.timeout = number, timeout
        super().__init__(
            f"Motion {number} has not ended within {timeout:g} s and goes on. Wait again, or call cancel()."
        )


class SimulationFailed(CorbotError):
    """A simulated robot did not start; `output` is the output of the program."""

    def __init__(self, reason: str, output: str = "") -> None:
        self.reason, self.output = reason, output
        super().__init__(f"{reason} {output}".strip())


class OrbError(CorbotError):
    """A failure inside the ORB: CORBA's `name` and `minor` code."""

    def __init__(self, name: str, minor: int) -> None:
        self.name, self.minor = name, minor
        super().__init__(
            f"The ORB failed with {name}, minor code {minor:#x}. Check that both ends are of one version."
        )
