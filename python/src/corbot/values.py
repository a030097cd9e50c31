# SPDX-License-Identifier: Apache-2.0
"""The readings of an arm. Metres, degrees, seconds and percent, like the interface."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from corbot.poses import Point, Pose, Quaternion


class Status(enum.Enum):
    """The activity of the robot."""

    ERROR = "Error"
    """Faulted until `clear`, or without its real-time task."""
    WAITING = "Waiting"
    """Busy: it moves, delays, is paused, or has motions queued."""
    STANDBY = "Standby"
    """At rest and ready."""


class MotionState(enum.Enum):
    """The stage of a motion."""

    QUEUED = "MotionQueued"
    RUNNING = "MotionRunning"
    DONE = "MotionDone"
    STOPPED = "MotionStopped"
    FAILED = "MotionFailed"

    @property
    def has_ended(self) -> bool:
        """Whether the state is final."""
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
    """Whether the gripper holds an object; known only if the device measures the opening."""

    UNKNOWN = "HoldingUnknown"
    NO = "HoldingNo"
    YES = "HoldingYes"


@dataclass(frozen=True)
class Gripper:
    """Openings in percent, 0 closed, 100 open; `opening` is the set-point if it is not `measured`."""

    commanded: float
    measured: bool
    opening: float
    holding: Holding


@dataclass(frozen=True)
class Device:
    """The controller of the arm: its `backend`, its `health` by the interface's name, and the `cause`."""

    backend: str
    health: str
    cause: str
    emergency_stop: bool


@dataclass(frozen=True)
class Control:
    """The holder of exclusive control (empty: none), the seconds left, and whether a hold is in force."""

    holder: str
    left: float
    held: bool


@dataclass(frozen=True)
class State:
    """The arm at the end of one cycle of its real-time task.

    Joints are in degrees, or metres if they slide; speeds in these a second.
    """

    time: float
    """The time at which the cycle was due, seconds since the Unix epoch."""
    age: float
    """The time from that instant to the reply, seconds."""
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
    """The motion in progress."""
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


@dataclass(frozen=True)
class JointLimits:
    """A joint with its limits: degrees (metres for a sliding joint), and these a second."""

    name: str
    kind: Literal["turns", "slides"]
    lower: float
    upper: float
    """The profile's range, which nothing exceeds."""
    speed: float
    soft_lower: float | None
    soft_upper: float | None
    """The soft limits in force. None: they are lost; no joint moves until they are set or reset."""


@dataclass(frozen=True)
class Frames:
    """The frames in force: `tool` from the flange to the tool centre point, `base` in the world."""

    tool: Pose
    base: Pose


PARTS = ("tool", "wrist", "elbow")
LINKS = ("upper arm", "forearm", "hand")
_NOWHERE = Point(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """A plane or a box of the workspace, metres: the named parts of the arm keep to it.

    Parts are those in `PARTS`, and those in `LINKS` if the profile of the arm gives `link_radius_m`.
    """

    name: str
    kind: Literal["plane", "in", "out"]
    parts: tuple[str, ...] = PARTS
    normal: Point = _NOWHERE
    offset: float = 0.0
    least: Point = _NOWHERE
    greatest: Point = _NOWHERE

    @classmethod
    def plane(
        cls, name: str, normal: Sequence[float], offset: float, *, parts: Sequence[str] = PARTS
    ) -> Shape:
        """Keep the parts on the side into which `normal` points, from `offset` along it on."""
        return cls(name, "plane", tuple(parts), normal=Point(*normal), offset=offset)

    @classmethod
    def box(
        cls,
        name: str,
        least: Sequence[float],
        greatest: Sequence[float],
        *,
        stay: Literal["in", "out"] = "out",
        parts: Sequence[str] = PARTS,
    ) -> Shape:
        """Keep the parts out of a box, or in it, between its corners."""
        return cls(name, stay, tuple(parts), least=Point(*least), greatest=Point(*greatest))


@dataclass(frozen=True)
class Workspace:
    """The planes and boxes in force: of the profile, and `further` ones that clients have set.

    If the further ones are not `known`, or hold for another base frame, no joint moves. This ends if they are
    set or reset, or that base frame is set. `further` is empty until then, and `known` is False.
    """

    profile: tuple[Shape, ...]
    further: tuple[Shape, ...]
    known: bool


@dataclass(frozen=True)
class Solution:
    """One solution of the arm for a pose."""

    number: int
    """As the arm's family counts them: docs/arms.md."""
    joints: tuple[float, ...]
    within_limits: bool
    orientation_error: float
    """The part of the orientation that the arm cannot reach, degrees."""


@dataclass(frozen=True)
class PlanLimit:
    """A stretch of a planned motion and its nearest limit."""

    begin: float
    """Seconds from the beginning of the part, at override 100 %."""
    end: float
    owner: Literal["joint", "tool", "tool turn"]
    joint: int | None
    """The number of the joint, if a joint is the owner."""
    limit: Literal["speed", "acceleration", "jerk"]
    share: float
    """The greatest share in the stretch, 0 to 1 of what a plan may use."""


@dataclass(frozen=True)
class PlanPart:
    """A part of a planned motion; an arc has two, the line to its beginning and the arc."""

    duration: float
    limits: tuple[PlanLimit, ...]
    """The limits in order of time; empty: nothing moves, or no limit determines the duration."""
    least_pivot: float | None
    """The distance of a line or an arc from a singularity, 0: through one. None: no such measure."""
    pivot_point: Point | None
    """The tool centre point at that place, metres."""


@dataclass(frozen=True)
class Plan:
    """A motion planned from the end of the accepted motions."""

    start: tuple[float, ...]
    """Joint values, degrees (metres for a sliding joint)."""
    end: tuple[float, ...]
    parts: tuple[PlanPart, ...]

    @property
    def duration(self) -> float:
        """Seconds at override 100 %."""
        return sum(part.duration for part in self.parts)


@dataclass(frozen=True)
class Speeds:
    """The speeds in force, percent of the profile's maximum: the tool's, and each joint's."""

    tool: float
    joints: tuple[float, ...]


@dataclass(frozen=True)
class Diagnostics:
    """Statistics of the real-time loop. Times are in seconds."""

    period: float
    since: float
    """The start of the counting, seconds since the Unix epoch."""
    cycles: int
    overruns: int
    """Cycles whose work ended after the next one was due."""
    latency_mean: float
    latency_max: float
    work_max: float
    real_time: bool
    counts: tuple[int, ...]
    """A histogram of the wake-up latency."""
    edges: tuple[float, ...]
    """The upper edge of each bucket; the last bucket is open."""


@dataclass(frozen=True)
class Servant:
    """The program that serves the arm: its version, its profile's fingerprint, and its start (Unix epoch)."""

    version: str
    profile: str
    started: float


# By the interface's names. A call of an enumeration's class is slow, and states are read 250 times a second.
_STATUSES = {status.value: status for status in Status}
_MOTION_STATES = {state.value: state for state in MotionState}
_HOLDINGS = {holding.value: holding for holding in Holding}


def motion_of(info: Any) -> MotionInfo:
    """Read a MotionInfo of the interface."""
    return MotionInfo(info.id, _MOTION_STATES[str(info.state)], info.progress, info.duration, info.reason)


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
        status=_STATUSES[str(state.status)],
        paused=bool(state.paused),
        override=state.overridePercent,
        joints=tuple(state.measuredJoints if state.measured else state.commanded),
        commanded=tuple(state.commanded),
        speeds=tuple(state.speeds),
        measured=bool(state.measured),
        tool=pose_of(state.tool),
        motion=motion_of(state.motion) if state.motion.id else None,
        queued=state.queued,
        gripper=Gripper(grip.commanded, bool(grip.measured), grip.opening, _HOLDINGS[str(grip.holding)]),
        device=Device(device.backend, str(device.health), device.causeText, bool(device.emergencyStop)),
        control=Control(control.holder, control.left, bool(control.held)),
    )


def alarm_of(alarm: Any) -> Alarm:
    """Read an AlarmInfo of the interface."""
    return Alarm(alarm.time, alarm.code, bool(alarm.active), alarm.text)


def limits_of(joints: Any, soft: Any) -> tuple[JointLimits, ...]:
    """Read the Joints and the SoftLimits of the interface."""
    ranges: list[tuple[float | None, float | None]] = [(limit.lower, limit.upper) for limit in soft]
    return tuple(
        JointLimits(
            joint.name,
            "slides" if str(joint.kind) == "JointSlides" else "turns",
            joint.range.lower,
            joint.range.upper,
            joint.speed,
            *between,
        )
        for joint, between in zip(joints, ranges or [(None, None)] * len(joints), strict=True)
    )


_SHAPE_KINDS: dict[str, Literal["plane", "in", "out"]] = {
    "ShapePlane": "plane",
    "ShapeInside": "in",
    "ShapeOutside": "out",
}


def _shape_of(shape: Any) -> Shape:
    normal, least, greatest = (
        Point(point.x, point.y, point.z) for point in (shape.normal, shape.least, shape.greatest)
    )
    parts = tuple(name for bit, name in enumerate(PARTS + LINKS) if shape.parts >> bit & 1)
    return Shape(shape.name, _SHAPE_KINDS[str(shape.kind)], parts, normal, shape.offset, least, greatest)


def workspace_of(info: Any) -> Workspace:
    """Read a WorkspaceInfo of the interface."""
    return Workspace(
        tuple(map(_shape_of, info.profile)), tuple(map(_shape_of, info.further)), bool(info.known)
    )


def solution_of(solution: Any) -> Solution:
    """Read a PoseSolution of the interface."""
    return Solution(
        solution.number, tuple(solution.joints), bool(solution.withinLimits), solution.orientationError
    )


_OWNERS: tuple[Literal["joint", "tool", "tool turn"], ...] = ("joint", "tool", "tool turn")
_LIMITS: tuple[Literal["speed", "acceleration", "jerk"], ...] = ("speed", "acceleration", "jerk")


def _plan_limit_of(stretch: Any) -> PlanLimit:
    joint = stretch.articulation if stretch.articulation >= 0 else None
    owner, limit = _OWNERS[stretch.owner._v], _LIMITS[stretch.limit._v]
    return PlanLimit(stretch.begin, stretch.end, owner, joint, limit, stretch.share)


def _plan_part_of(part: Any) -> PlanPart:
    point = part.pivotPoint
    pivot = (part.leastPivot, Point(point.x, point.y, point.z)) if part.hasPivot else (None, None)
    return PlanPart(part.duration, tuple(map(_plan_limit_of, part.stretches)), *pivot)


def plan_of(plan: Any) -> Plan:
    """Read a PlanInfo of the interface."""
    return Plan(tuple(plan.start), tuple(plan.end), tuple(map(_plan_part_of, plan.parts)))


def diagnostics_of(loop: Any) -> Diagnostics:
    """Read a LoopInfo of the interface."""
    return Diagnostics(
        loop.period,
        loop.since,
        loop.cycles,
        loop.overruns,
        loop.latencyMean,
        loop.latencyMax,
        loop.workMax,
        bool(loop.realTime),
        tuple(loop.counts),
        tuple(loop.edges),
    )
