# SPDX-License-Identifier: Apache-2.0
"""Every operation of arm.idl and of robot.idl is reached through the package, or left out with the reason."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib import resources
from itertools import islice

import pytest

import corbot
from support import skip_without, until

STARTS = "the package begins the motion by Start…, and waits in slices, so that Ctrl-C stops the arm"
IN_STATE = "arm.state has it, of the same cycle as all the rest"
LEFT_OUT = {
    **dict.fromkeys(
        ("Move", "MoveS", "MoveC", "MovePose", "MovePoseS", "MoveRelative", "MoveRelativeS"), STARTS
    ),
    **dict.fromkeys(("MoveJoints", "Drive", "Ready", "Delay", "Open", "Close", "SetGripper"), STARTS),
    **dict.fromkeys(("_get_ArtiCoord", "_get_CartCoord", "_get_GripperStatus", "_get_Status"), IN_STATE),
    **dict.fromkeys(
        ("_get_Paused", "_get_OverridePercent", "_get_Gripper", "_get_Device", "_get_Control"), IN_STATE
    ),
    "_get_CycleAge": "arm.state.age is the age of what was read",
    "_get_DoF": "len(arm.joint_names) is the same number",
    "_get_MovRange": "arm.limits has the ranges, with names and kinds of joints",
}


def declared(file: str) -> set[str]:
    """Read the operations and the attributes of the interfaces in a file."""
    text = re.sub(r"//.*", "", resources.files("corbot").joinpath("idl", file).read_text(encoding="utf-8"))
    names: set[str] = set()
    for body in re.findall(r"interface \w+[^{;]*\{(.*?)\n  \};", text, re.DOTALL):
        names |= {f"_get_{name}" for name in re.findall(r"readonly attribute\s+\w+\s+(\w+)", body)}
        names |= set(re.findall(r"^    \w+\s+(\w+)\s*\(", body, re.MULTILINE))
    return names


def move_in_each_way(arm: corbot.Arm) -> None:
    arm.move(0.20, 0.05, 0.09)
    arm.line(0.20, 0.05, 0.08)
    arm.arc((0.20, 0.05, 0.09), (0.20, 0.0, 0.12), (0.20, -0.05, 0.09))
    pose = arm.state.tool
    arm.pose(pose)
    arm.pose(pose, line=True)
    arm.relative(z=0.01)
    arm.relative(z=0.01, line=True)
    arm.drive("base", 5, speed=45)
    arm.joints([0, 10, 20, 30])
    arm.ready()
    arm.delay(0.01)
    arm.open()
    arm.gripper(50)
    arm.close()
    motion = arm.joints([5, 0, 0, 0], wait=False)
    assert motion.progress <= 1
    motion.cancel()


def read_everything(arm: corbot.Arm) -> None:
    list(islice(arm.states(100), 2))
    pose = arm.state.tool
    assert arm.solutions(pose)
    _ = (
        arm.limits,
        arm.frames,
        arm.solution,
        arm.reach,
        arm.kind,
        arm.diagnostics,
        arm.servant,
        arm.description,
    )
    _ = (arm.alarms, arm.speeds, arm.tool_pitch, arm.tool_orientation)


def plan_everything(arm: corbot.Arm) -> None:
    arm.move(0.20, 0.05, 0.10)  # with room around it
    before = arm.state
    assert arm.plan("move", 0.20, 0.05, 0.09).duration > 0
    assert arm.plan("line", 0.20, 0.05, 0.08, time=3).duration == pytest.approx(3)
    assert len(arm.plan("arc", (0.20, 0.05, 0.09), (0.20, 0.0, 0.12), (0.20, -0.05, 0.09)).parts) == 2
    for line in (False, True):
        assert arm.plan("pose", before.tool, line=line).end == pytest.approx(before.joints, abs=1e-3)
        assert arm.plan("relative", z=0.01, line=line).duration > 0
    turn = arm.plan("drive", "base", 5, speed=45)
    assert turn.start == before.joints
    assert turn.end == pytest.approx((before.joints[0] + 5, *before.joints[1:]))
    assert {limit.owner for part in turn.parts for limit in part.limits} <= {"joint"}
    assert arm.plan("joints", [0, 10, 20, 30]).end == pytest.approx((0, 10, 20, 30))
    assert arm.plan("ready").end == (0, 0, 0, 0)
    with pytest.raises(corbot.Unreachable):
        arm.plan("line", 5, 0, 0)
    with pytest.raises(ValueError, match="No plan is made of 'open'"):
        arm.plan("open")
    assert arm.state.joints == before.joints


def set_everything(arm: corbot.Arm) -> None:
    arm.set_limits([(limit.lower, limit.upper) for limit in arm.limits])
    arm.reset_limits()
    arm.set_workspace([corbot.Shape.plane("floor2", (0, 0, 1), -1.0)])
    assert arm.workspace.further[0].parts == ("tool", "wrist", "elbow")
    arm.reset_workspace()
    arm.set_frames(tool=arm.frames.tool, base=arm.frames.base)
    arm.reset_frames()
    arm.set_speeds(tool=100, joints=100)
    arm.set_speeds(joints=[100] * 4)
    arm.set_tool_pitch(0)
    with pytest.raises(corbot.BadParameter):  # of an arm that has four joints
        arm.set_tool_orientation(corbot.Quaternion())
    arm.set_tool_orientation(None)
    arm.override(100)
    arm.pause()
    arm.resume()
    arm.hold()
    arm.clear()
    arm.stop()


@pytest.fixture(params=["omniorb", "orbit2"])
def arm(request: pytest.FixtureRequest) -> Iterator[corbot.Arm]:
    skip_without(request.param)
    with corbot.simulated("lynx5", orb=request.param) as arm:
        yield arm


def test_every_operation_is_reached_or_left_out_with_a_reason(arm: corbot.Arm, reached: set[str]) -> None:
    operations = declared("robot.idl") | declared("arm.idl")
    assert len(operations) > 70, "the interface was not read"
    move_in_each_way(corbot.connect(arm.address))  # a fresh one, which has cached nothing
    read_everything(corbot.connect(arm.address))
    plan_everything(arm)
    set_everything(arm)
    with arm.control("Ada", lease=0.6):
        until(lambda: "Renew" in reached)
    assert operations - reached - LEFT_OUT.keys() == set(), "not in the package, nor listed as left out"
    assert LEFT_OUT.keys() - operations == set(), "left out, but not in the interface"
    assert LEFT_OUT.keys() & reached == set(), "left out, but in the package"
