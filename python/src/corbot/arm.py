# SPDX-License-Identifier: Apache-2.0
"""A robot arm. Metres, degrees, seconds and percent everywhere, like the interface."""

from __future__ import annotations

import contextlib
import operator
import threading
import time
import warnings
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures import wait as wait_for
from functools import cached_property, partial
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, SupportsIndex, TypeVar

import numpy as np

from corbot import _locate, _orb
from corbot.errors import CorbotError, LimitExceeded, NotOffered
from corbot.model import Model
from corbot.motion import Motion
from corbot.poses import Array, Point, Pose, Quaternion
from corbot.states import States
from corbot.values import (
    LINKS,
    PARTS,
    Alarm,
    Diagnostics,
    Frames,
    JointLimits,
    MotionInfo,
    MotionState,
    Plan,
    Servant,
    Shape,
    Solution,
    Speeds,
    State,
    Workspace,
    alarm_of,
    diagnostics_of,
    limits_of,
    plan_of,
    pose_of,
    solution_of,
    state_of,
    workspace_of,
)

_PLANNED = ("move", "line", "arc", "pose", "relative", "joints", "drive", "ready")
PointLike = Sequence[float] | Array
_Value = TypeVar("_Value")


def connect(robot: str | None = None, *, timeout: float = 10.0) -> Arm:
    """Connect to an arm.

    `robot` is the name of one that is up on this machine, HOST:PORT/NAME, a corbaloc, a corbaname or an IOR.
    Without it, $CORBOT_ROBOT or the only robot that is up here is used. `timeout` bounds each call, seconds,
    not a motion.

    A robot that has only the interface of robot.idl moves, too, but has no Stop: Ctrl-C waits for the end of
    its motion.
    """
    address = _locate.address_of(robot)
    return Arm(address, _orb.connect(address, timeout, _orb.Corbot.Arm, _orb.Corbot.Robot), timeout)


class Arm:
    """A robot arm.

    Each motion returns when it has ended at its target. With `wait=False` it returns a Motion at once. `time`
    is the duration in seconds; 0 means as fast as the limits allow. If the limits do not allow `time`, the
    motion takes longer, and its `duration` says how long. Ctrl-C during the wait for a motion stops the arm.

    `with corbot.connect(...) as arm:` stops the arm when an exception leaves the block.
    """

    def __init__(self, address: str, reference: Any, timeout: float) -> None:
        self._reference, self._timeout = reference, timeout
        self.address = address
        """The CORBA address at which the arm was found."""

    if not TYPE_CHECKING:  # type checkers find such assignments by themselves

        def __setattr__(self, name: str, value: object) -> None:
            """Refuse `arm.override = 20`, which would set nothing and replace the method."""
            if not name.startswith("_") and name != "address":
                is_method = callable(getattr(type(self), name, None))
                fix = f"call arm.{name}(...)" if is_method else f"it has no '{name}' that can be set"
                raise AttributeError(f"an arm takes no value by assignment: {fix}", name=name, obj=self)
            super().__setattr__(name, value)

    def __enter__(self) -> Arm:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        if error is not None:
            self.stop_because_of(error)

    def __repr__(self) -> str:
        return f"<Arm at {self.address}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Connect anew in another process: a copied reference has no timeout."""
        return (partial(connect, self.address, timeout=self._timeout), ())

    # Motions

    def move(
        self, x: float, y: float, z: float, *, above: float = 0.0, time: float = 0.0, wait: bool = True
    ) -> Motion:
        """Move the tool freely to the point `above` metres above (x, y, z), metres in the base frame."""
        return self._begin("Move", *_floats(x, y, z, above, time), wait=wait)

    def line(
        self, x: float, y: float, z: float, *, above: float = 0.0, time: float = 0.0, wait: bool = True
    ) -> Motion:
        """Move the tool along a straight line to the point `above` metres above (x, y, z), metres."""
        return self._begin("MoveS", *_floats(x, y, z, above, time), wait=wait)

    def arc(self, start: PointLike, through: PointLike, end: PointLike, *, wait: bool = True) -> Motion:
        """Move the tool along the arc of three points, metres.

        From any other point it first moves to `start` in a line.
        """
        return self._begin("MoveC", *map(_point, (start, through, end)), wait=wait)

    def pose(self, target: Pose, *, line: bool = False, time: float = 0.0, wait: bool = True) -> Motion:
        """Move the tool to a position and an orientation, freely or along a straight line."""
        return self._begin("MovePoseS" if line else "MovePose", _pose(target), _number(time), wait=wait)

    def relative(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        *,
        turn: Quaternion | None = None,
        frame: Literal["base", "tool"] = "base",
        line: bool = False,
        time: float = 0.0,
        wait: bool = True,
    ) -> Motion:
        """Move the tool by an offset in metres along the axes of base or tool, and turn it by `turn`."""
        offset = _pose(Pose(Point(x, y, z), Quaternion() if turn is None else turn))
        if frame not in ("base", "tool"):
            raise ValueError(f"A frame is 'base' or 'tool', not {frame!r}. Nothing moved.")
        axes = _orb.Corbot.OffsetInBase if frame == "base" else _orb.Corbot.OffsetInTool
        return self._begin(
            "MoveRelativeS" if line else "MoveRelative", offset, axes, _number(time), wait=wait
        )

    def joints(self, target: Sequence[float] | Array, *, time: float = 0.0, wait: bool = True) -> Motion:
        """Move all joints to values in degrees, or metres for a sliding joint; one value for each joint."""
        return self._begin("MoveJoints", _floats(*_joint_list(target)), _number(time), wait=wait)

    def drive(self, joint: SupportsIndex | str, by: float, *, speed: float, wait: bool = True) -> Motion:
        """Move one joint, given by its number from 0 or its name.

        Units are degrees and degrees a second, or metres and metres a second if it slides.
        """
        number = self._number_of(joint) if isinstance(joint, str) else operator.index(joint)
        return self._begin("Drive", number, *_floats(by, speed), wait=wait)

    def ready(self, *, wait: bool = True) -> Motion:
        """Move all joints to zero."""
        return self._begin("Ready", wait=wait)

    def open(self, *, wait: bool = True) -> Motion:
        """Open the gripper."""
        return self._begin("Open", wait=wait)

    def close(self, *, wait: bool = True) -> Motion:
        """Close the gripper."""
        return self._begin("Close", wait=wait)

    def gripper(self, percent: float, *, wait: bool = True) -> Motion:
        """Move the gripper to an opening in percent, 0 closed, 100 open."""
        return self._begin("SetGripper", _number(percent), wait=wait)

    def delay(self, seconds: float, *, wait: bool = True) -> Motion:
        """Hold for this number of seconds, in turn with the motions."""
        return self._begin("Delay", _number(seconds), wait=wait)

    def stop(self) -> None:
        """Stop the arm on its path and discard queued motions; returns at rest. Any thread may call it."""
        self.call("Stop")

    def hold(self) -> None:
        """Stop the arm, and prevent all motion by any client until `clear`.

        A power-down does not end the hold.
        """
        self.call("StopAndHold")

    def clear(self) -> None:
        """Leave Error, if its cause is gone."""
        self.call("Clear")

    def pause(self) -> None:
        """Decelerate on the path and hold until `resume`; returns at once."""
        self.call("Pause")

    def resume(self) -> None:
        """Continue after `pause`."""
        self.call("Resume")

    def plan(self, motion: str, *arguments: Any, **options: Any) -> Plan:
        """Plan a motion as its method would begin it now, from the end of the queue; nothing moves.

        `motion` names the method: move, line, arc, pose, relative, joints, drive or ready.
        `arm.plan("line", 0.2, 0, 0.1, time=2)` plans `arm.line(0.2, 0, 0.1, time=2)`. The caller
        needs no control.
        """
        if motion not in _PLANNED:
            raise ValueError(f"No plan is made of '{motion}', but of {', '.join(_PLANNED)}.")
        planner = _Planner(self.address, self._reference, self._timeout)
        getattr(planner, motion)(*arguments, **options)
        return plan_of(planner._found)

    # Reading

    @property
    def state(self) -> State:
        """The complete state of the arm at one instant."""
        return state_of(self.call("_get_State"))

    @property
    def alarms(self) -> list[Alarm]:
        """The last 64 alarms, oldest first."""
        return [alarm_of(alarm) for alarm in self.call("_get_Alarms")]

    def states(self, rate: float) -> States:
        """Give an endless iterator of `rate` states a second.

        It drops late states, and counts them in `dropped`.
        """
        return States(lambda: self.state, rate)

    @property
    def limits(self) -> tuple[JointLimits, ...]:
        """Each joint's range, speed and soft limits, in degrees (metres if it slides), and these a second."""
        return limits_of(self._joints, self.call("_get_SoftLimits"))

    def set_limits(self, ranges: Sequence[tuple[float, float]] | Array) -> None:
        """Set soft limits, lower and upper for each joint, degrees (metres). They outlive a power-down."""
        self.call("SetSoftLimits", [_range(limit) for limit in _joint_list(ranges)])

    def reset_limits(self) -> None:
        """Restore the profile's ranges as soft limits."""
        self.call("ResetSoftLimits")

    @property
    def workspace(self) -> Workspace:
        """The planes and boxes to which motions keep: the profile's, and those that clients have set."""
        return workspace_of(self.call("_get_Workspace"))

    def set_workspace(self, further: Sequence[Shape]) -> None:
        """Set planes and boxes beside the profile's, for all clients. They outlive a power-down."""
        self.call("SetWorkspace", [_shape(shape) for shape in further])

    def reset_workspace(self) -> None:
        """Remove the planes and boxes that clients have set."""
        self.call("ResetWorkspace")

    @property
    def frames(self) -> Frames:
        """The tool frame and the base frame in force."""
        return Frames(tool=pose_of(self.call("_get_ToolFrame")), base=pose_of(self.call("_get_BaseFrame")))

    def set_frames(self, *, tool: Pose | None = None, base: Pose | None = None) -> None:
        """Set the tool frame (from the flange) or the base frame (of the arm) for all clients; metres."""
        given = (("SetToolFrame", tool), ("SetBaseFrame", base))
        for call in [(operation, _pose(frame)) for operation, frame in given if frame is not None]:
            self.call(*call)

    def reset_frames(self) -> None:
        """Restore both frames of the profile."""
        self.call("ResetFrames")

    def solutions(self, pose: Pose) -> list[Solution]:
        """All solutions for a pose of the tool, regardless of limits.

        Joints are in degrees, or metres if they slide.
        """
        return [solution_of(solution) for solution in self.call("Solutions", _pose(pose))]

    @property
    def solution(self) -> int | None:
        """The number of the arm's present solution; None: the arm has no closed form."""
        number: int = self.call("_get_Solution")
        return None if number < 0 else number

    @property
    def reach(self) -> float:
        """The largest distance of the tool from the first axis, metres."""
        return float(self.call("_get_Reach"))

    @property
    def kind(self) -> str:
        """The kind of arm by the interface's name: Anthropomorphic, Scara and so on."""
        return str(self.call("_get_RobotType"))

    @property
    def diagnostics(self) -> Diagnostics:
        """Statistics of the real-time loop."""
        return diagnostics_of(self.call("_get_Diagnostics"))

    @property
    def servant(self) -> Servant:
        """The program that serves the arm."""
        info = self.call("_get_Servant")
        return Servant(info.version, info.profile, info.started)

    @cached_property
    def description(self) -> str:
        """The profile's arm as a URDF, identical to the output of `corbot export --urdf`."""
        return str(self.call("_get_Description"))

    @cached_property
    def model(self) -> Model:
        """The arm by its description: the frames of its links and its tool for any joint values."""
        return Model.from_urdf(self.description)

    def _repr_svg_(self) -> str:
        """Draw the arm at its present joints, and planes and boxes near it, in a notebook."""
        workspace = self.workspace
        return self.model.svg(self.state.joints, workspace.profile + workspace.further, self.frames.base)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The names of the joints, in the order of all lists of them."""
        return tuple(joint.name for joint in self._joints)

    @cached_property
    def _joints(self) -> Any:
        return self.call("_get_Joints")

    # Settings, which apply to all motions, of any client, that are accepted from then on

    @property
    def speeds(self) -> Speeds:
        """The speeds in force, percent of the profile's maximum."""
        speeds = self.call("_get_Speeds")
        return Speeds(speeds.tool, tuple(speeds.joints))

    def set_speeds(
        self, *, tool: float | None = None, joints: float | Sequence[float] | Array | None = None
    ) -> None:
        """Set speeds in percent: `tool` scales lines, arcs and free motions; `joints` one or all joints."""
        calls: list[tuple[Any, ...]] = []  # made once all arguments are known to be good
        one_or_all: Any = joints
        if tool is not None:
            calls.append(("Speed", _number(tool)))
        if joints is not None and np.ndim(one_or_all) == 0:
            calls.append(("AllSpeed", _number(one_or_all)))
        elif joints is not None:
            speeds = _floats(*one_or_all)
            if len(speeds) != len(self.joint_names):
                raise ValueError(
                    f"The arm has {len(self.joint_names)} joints, and these are {len(speeds)} speeds."
                )
            calls += [("ArtSpeed", number, percent) for number, percent in enumerate(speeds)]
        for call in calls:
            self.call(*call)

    def override(self, percent: float) -> None:
        """Set the rate of all motion, including the present one: above 0, at most 100 percent of the plan."""
        self.call("Override", _number(percent))

    @property
    def tool_pitch(self) -> float:
        """The inclination of the tool for `move`, `line` and `arc`, degrees above the horizontal."""
        return float(self.call("_get_ToolPitch"))

    def set_tool_pitch(self, degrees: float) -> None:
        """Set the tool pitch; only arms of four or five joints have one."""
        self.call("SetToolPitch", _number(degrees))

    @property
    def tool_orientation(self) -> Quaternion | None:
        """The orientation of the tool for `move`, `line` and `arc`; None: the tool keeps its present one."""
        info = self.call("_get_ToolOrientation")
        q = info.orientation
        return Quaternion(q.w, q.x, q.y, q.z) if info.set else None

    def set_tool_orientation(self, orientation: Quaternion | None) -> None:
        """Set the tool orientation; None removes it, and the tool pitch, too."""
        if orientation is None:
            self.call("ResetToolOrientation")
        else:
            self.call("SetToolOrientation", _quaternion(orientation))

    # Exclusive control

    @contextlib.contextmanager
    def control(self, who: str, *, lease: float = 10.0) -> Iterator[Arm]:
        """Take exclusive control of the arm within the block, under the name `who`.

        A thread renews the lease, `lease` seconds, while the program lives. At the end of the block the arm
        stops.
        """
        seconds = _number(lease)
        plain, ended = self._reference, threading.Event()
        held = None
        try:
            with _orb.uninterrupted():  # Ctrl-C meanwhile releases control, too
                held = self.call("Acquire", who, seconds)
                _orb.set_timeout(held, self._timeout)
            self._reference = held
            threading.Thread(target=self._renew, args=(held, seconds / 3.0, ended), daemon=True).start()
            yield self
        except BaseException:
            if held is not None:
                with contextlib.suppress(CorbotError):  # the block's exception says more
                    self._release(held, plain, ended)
            raise
        self._release(held, plain, ended)

    def _release(self, held: Any, plain: Any, ended: threading.Event) -> None:
        ended.set()  # a renewal on its way is refused after the release; nobody waits for it
        self._reference = plain
        _orb.call(self.address, held.Release)

    def _renew(self, held: Any, every: float, ended: threading.Event) -> None:
        while not ended.wait(every):
            with contextlib.suppress(CorbotError):  # the next motion reports that control has ended
                _orb.call(self.address, held.Renew)

    # Calls

    def call(self, operation: str, *arguments: Any) -> Any:
        """Call an operation of the interface Corbot::Arm by its name, with its own types."""
        found = getattr(self._reference, operation, None)
        if found is None and self._has_robot_idl_alone:
            raise NotOffered(self.address, operation)
        if found is None:
            raise AttributeError(f"The interface Corbot::Arm has no operation '{operation}'. Nothing moved.")
        try:
            return _orb.call(self.address, found, *arguments)
        except LimitExceeded as error:
            raise self._with_unit(error) from None

    def _with_unit(self, error: LimitExceeded) -> LimitExceeded:
        """Give the refusal the unit of its joint, if the robot reports the kind of the joint."""
        try:
            slides = str(self._joints[error.joint].kind) == "JointSlides"
        except (CorbotError, IndexError):
            return error
        unit = ("m" if slides else "degrees") + (" a second" if error.quantity == "speed" else "")
        known = unit if error.joint >= 0 else ""
        return LimitExceeded(error.quantity, error.joint, error.value, error.lower, error.upper, known)

    @contextlib.contextmanager
    def stopped_by_interrupt(self) -> Iterator[None]:
        """Stop the arm on Ctrl-C within the block."""
        try:
            yield
        except KeyboardInterrupt as interrupt:
            self.stop_because_of(interrupt)
            raise

    def _number_of(self, joint: str) -> int:
        if joint not in self.joint_names:
            raise ValueError(
                f"The arm has no joint '{joint}', but {', '.join(self.joint_names)}. Nothing moved."
            )
        return self.joint_names.index(joint)

    @cached_property
    def _has_robot_idl_alone(self) -> bool:
        return isinstance(self._reference, _orb.Corbot._objref_Robot) and not hasattr(
            self._reference, "StartReady"
        )

    @cached_property
    def _patient(self) -> Any:
        """A reference for calls that return when a motion has ended."""
        return _orb.connect(self.address, 3600.0, _orb.Corbot.Robot)

    def _carry_out(self, operation: str, *arguments: Any) -> Motion:
        """Call an operation that returns at the end of its motion, in a thread: Ctrl-C reaches this one."""
        if not hasattr(self._patient, operation):
            raise NotOffered(self.address, operation)
        begun, ended, wanted = time.monotonic(), Future[None](), threading.Event()

        def call() -> None:
            wanted.wait()
            try:
                ended.set_result(_orb.call(self.address, getattr(self._patient, operation), *arguments))
            except Exception as error:
                ended.set_exception(error)

        threading.Thread(target=call, daemon=True).start()  # on Ctrl-C before this line, nothing is called
        try:
            wanted.set()
            _await(ended)
        except KeyboardInterrupt:
            if not wanted.is_set():
                raise
            wanted.set()  # the first one may have woken no thread
            told = "This robot has no Stop: its motion is awaited. Ctrl-C again leaves it moving."
            warnings.warn(told, RuntimeWarning, stacklevel=4)
            _await(ended)
            raise
        ended.result()
        return Motion(self, 0, MotionInfo(0, MotionState.DONE, 1.0, time.monotonic() - begun, ""))

    def _begin(self, operation: str, *arguments: Any, wait: bool) -> Motion:
        if self._has_robot_idl_alone:
            return self._carry_out(operation if wait else f"Start{operation}", *arguments)
        with self.stopped_by_interrupt():  # covers also a motion whose number Ctrl-C has discarded
            motion = Motion(self, self.call(f"Start{operation}", *arguments))
            if wait:
                motion.wait()
        return motion

    def stop_because_of(self, error: BaseException) -> None:
        """Stop the arm while `error` leaves a block; a failed stop is reported, and hides nothing."""
        try:
            self.stop()
        except CorbotError as failure:
            told = f"The arm may still move: {failure}"
            if isinstance(error, KeyboardInterrupt):
                raise KeyboardInterrupt(told) from failure
            warnings.warn(told, RuntimeWarning, stacklevel=3)


class _Planner(Arm):
    """An arm whose motions are planned but not started."""

    _found: Any = None

    def _begin(self, operation: str, *arguments: Any, wait: bool) -> Motion:
        self._found = self.call(f"Plan{operation}", *arguments)
        return Motion(self, 0)


def _await(ended: Future[None]) -> None:
    """Wait for the end in slices: Ctrl-C just before a wait begins does not end the wait."""
    while not ended.done():
        wait_for([ended], timeout=0.2)


def _number(value: Any) -> float:
    if isinstance(value, (str, bytes, bytearray)):  # float() would convert it, too
        raise TypeError(f"{value!r} is a text where a number is expected.")
    return float(value)


def _floats(*values: float) -> list[float]:
    return [_number(value) for value in values]


def _row(values: Iterable[float], count: int, expected: str) -> list[float]:
    row = list(values) if isinstance(values, Iterable) else []
    if len(row) != count:
        raise ValueError(f"{expected}, not {values!r}.")
    return _floats(*row)


def _joint_list(values: Iterable[_Value]) -> list[_Value]:
    """Refuse values that no arm can take; the servant checks their number."""
    listed = list(values)
    if len(listed) > _orb.MOST_JOINTS:
        raise ValueError(
            f"These are {len(listed)} values, and an arm has at most {_orb.MOST_JOINTS} joints. "
            "Nothing moved."
        )
    return listed


def _range(limits: Iterable[float]) -> Any:
    return _orb.Corbot.JointRange(*_row(limits, 2, "A range is a lower and an upper limit"))


def _shape(shape: Shape) -> Any:
    kinds = {
        "plane": _orb.Corbot.ShapePlane,
        "in": _orb.Corbot.ShapeInside,
        "out": _orb.Corbot.ShapeOutside,
    }
    unknown = [part for part in shape.parts if part not in PARTS + LINKS]
    if shape.kind not in kinds or unknown:
        wrong = unknown[0] if unknown else shape.kind
        raise ValueError(f"'{wrong}' is no kind of a shape and no part of {', '.join(PARTS + LINKS)}.")
    return _orb.Corbot.WorkspaceShape(
        shape.name,
        kinds[shape.kind],
        sum(1 << (PARTS + LINKS).index(part) for part in set(shape.parts)),
        _point(shape.normal),
        float(shape.offset),
        _point(shape.least),
        _point(shape.greatest),
    )


def _point(point: PointLike) -> Any:
    return _orb.Corbot.Point(*_row(point, 3, "A point is three numbers, x, y and z"))


def _quaternion(orientation: Quaternion) -> Any:
    return _orb.Corbot.Quaternion(*_row(orientation, 4, "A rotation is a corbot.Quaternion"))


def _pose(pose: Pose) -> Any:
    if not isinstance(pose, Pose):
        raise TypeError(f"A pose is a corbot.Pose, not {pose!r}. Pose.from_matrix makes one of a matrix.")
    return _orb.Corbot.Pose(_point(pose.position), _quaternion(pose.orientation))
