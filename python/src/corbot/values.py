# SPDX-License-Identifier: Apache-2.0
"""What is read of an arm, and poses. Metres, degrees, seconds and percent, as at the interface."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Point:
    """A position in the base frame, metres."""

    x: float
    y: float
    z: float


@dataclass(frozen=True)
class Quaternion:
    """A rotation, of unit length; none unless given."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Pose:
    """A position in metres, and the orientation of the tool frame in the base frame."""

    position: Point
    orientation: Quaternion = Quaternion()


class Status(enum.Enum):
    """What the robot does."""

    ERROR = "Error"
    """Faulted until `clear`, or its real-time task is not there."""
    WAITING = "Waiting"
    """Busy: it moves, delays, is paused, or has motions queued."""
    STANDBY = "Standby"
    """At rest and ready."""


class MotionState(enum.Enum):
    """How far a motion has got."""

    QUEUED = "MotionQueued"
    RUNNING = "MotionRunning"
    DONE = "MotionDone"
    STOPPED = "MotionStopped"
    FAILED = "MotionFailed"

    @property
    def has_ended(self) -> bool:
        """Whether nothing follows."""
        return self not in (MotionState.QUEUED, MotionState.RUNNING)


@dataclass(frozen=True)
class MotionInfo:
    """A motion at one instant: `progress` 0 to 1 of its own time, `duration` in seconds as planned."""

    number: int
    state: MotionState
    progress: float
    duration: float
    reason: str


class Holding(enum.Enum):
    """Whether the gripper holds something; only a device that measures the opening can tell."""

    UNKNOWN = "HoldingUnknown"
    NO = "HoldingNo"
    YES = "HoldingYes"


@dataclass(frozen=True)
class Gripper:
    """Openings in percent, 0 closed, 100 open; `opening` is the set-point where it is not `measured`."""

    commanded: float
    measured: bool
    opening: float
    holding: Holding


@dataclass(frozen=True)
class Device:
    """The controller that drives the arm: its `backend`, its `health` as the interface names it, and the `cause`."""

    backend: str
    health: str
    cause: str
    emergency_stop: bool


@dataclass(frozen=True)
class Control:
    """Who has exclusive control (empty: nobody), the seconds left of it, and whether a hold is in force."""

    holder: str
    left: float
    held: bool


@dataclass(frozen=True)
class State:
    """The arm at the end of one cycle of its real-time task.

    Joints are in degrees, metres of one that slides; speeds in these a second.
    """

    time: float
    """When the cycle was due, seconds since the Unix epoch."""
    age: float
    """From then to the reply, seconds."""
    status: Status
    paused: bool
    override: float
    """Percent of the planned rate."""
    joints: tuple[float, ...]
    """Measured where the device measures them, else the set-points."""
    commanded: tuple[float, ...]
    """Set-points."""
    speeds: tuple[float, ...]
    """Speeds of the set-points."""
    measured: bool
    """Whether the device measures the joints."""
    tool: Pose
    """Tool centre point, of `joints`."""
    motion: MotionInfo | None
    """The one under way."""
    queued: int
    """Motions that are accepted and have not begun."""
    gripper: Gripper
    device: Device
    control: Control


@dataclass(frozen=True)
class Alarm:
    """An event for the operator: `time` in seconds since the Unix epoch; docs/alarms.md lists the codes."""

    time: float
    code: int
    active: bool
    text: str


def motion_of(info: Any) -> MotionInfo:
    """Read a MotionInfo of the interface."""
    return MotionInfo(info.id, MotionState(str(info.state)), info.progress, info.duration, info.reason)


def pose_of(pose: Any) -> Pose:
    """Read a Pose of the interface."""
    p, q = pose.position, pose.orientation
    return Pose(Point(p.x, p.y, p.z), Quaternion(q.w, q.x, q.y, q.z))


def state_of(state: Any) -> State:
    """Read an ArmState of the interface."""
    grip, device, control = state.gripper, state.device, state.control
    return State(
        time=state.time,
        age=state.age,
        status=Status(str(state.status)),
        paused=bool(state.paused),
        override=state.overridePercent,
        joints=tuple(state.measuredJoints if state.measured else state.commanded),
        commanded=tuple(state.commanded),
        speeds=tuple(state.speeds),
        measured=bool(state.measured),
        tool=pose_of(state.tool),
        motion=motion_of(state.motion) if state.motion.id else None,
        queued=state.queued,
        gripper=Gripper(grip.commanded, bool(grip.measured), grip.opening, Holding(str(grip.holding))),
        device=Device(device.backend, str(device.health), device.causeText, bool(device.emergencyStop)),
        control=Control(control.holder, control.left, bool(control.held)),
    )


def alarm_of(alarm: Any) -> Alarm:
    """Read an AlarmInfo of the interface."""
    return Alarm(alarm.time, alarm.code, bool(alarm.active), alarm.text)
