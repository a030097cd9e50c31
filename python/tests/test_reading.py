# SPDX-License-Identifier: Apache-2.0
"""Frames, limits, solutions, settings and streams of states."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

import corbot
from corbot import Point, Pose, Quaternion
from corbot.simulation import find_profile, find_program
from support import FAR, until


@pytest.fixture(scope="module")
def puma() -> Iterator[corbot.Arm]:
    with corbot.simulated("puma560") as arm:
        yield arm


def test_the_description_is_the_urdf_that_corbot_exports(arm: corbot.Arm) -> None:
    program = find_program()
    export = [str(program), "export", "--urdf", str(find_profile("lynx5", program))]
    assert arm.description == subprocess.check_output(export, text=True)


def test_limits_are_those_of_the_profile_until_they_are_set(arm: corbot.Arm) -> None:
    base = arm.limits[0]
    assert (base.name, base.kind, base.lower, base.upper) == ("base", "turns", -90, 90)
    assert (base.soft_lower, base.soft_upper) == (base.lower, base.upper)
    arm.set_limits([(-10, 10)] + [(joint.lower, joint.upper) for joint in arm.limits[1:]])
    assert (arm.limits[0].soft_lower, arm.limits[0].soft_upper) == (-10, 10)
    with pytest.raises(corbot.LimitExceeded, match="not within -10 to 10"):
        arm.joints([20, 0, 0, 0])
    arm.reset_limits()
    assert arm.limits[0].soft_upper == 90


def test_a_workspace_is_read_as_it_was_set(arm: corbot.Arm) -> None:
    assert arm.workspace == corbot.Workspace((), (), known=True)
    shapes = (
        corbot.Shape.plane("low", (0, 0, 1), 0.05, parts=["tool"]),
        corbot.Shape.box("post", (1, 1, 0), (1.5, 1.5, 1)),
        corbot.Shape.box("cage", (-2, -2, -2), (2, 2, 2), stay="in", parts=["elbow", "wrist"]),
    )
    arm.set_workspace(shapes)
    assert arm.workspace.further[:2] == shapes[:2]
    assert arm.workspace.further[2].parts == ("wrist", "elbow")
    with pytest.raises(corbot.LimitExceeded, match="below 'low'"):
        arm.drive(1, -2, speed=40)
    with pytest.raises(corbot.BadParameter, match="9 planes and boxes, allowed at most 8"):
        arm.set_workspace([corbot.Shape.plane(f"p{k}", (0, 0, 1), -1) for k in range(9)])
    with pytest.raises(corbot.BadParameter, match="parts hand: the profile gives no link_radius_m"):
        arm.set_workspace([corbot.Shape.plane("p", (0, 0, 1), -1, parts=["hand"])])
    with pytest.raises(ValueError, match="'foot' is no kind"):
        arm.set_workspace([corbot.Shape.plane("p", (0, 0, 1), -1, parts=["foot"])])
    command = [str(find_program()), "workspace", "--robot", arm.address]
    assert subprocess.check_output(command, text=True) == (
        "set      low  beyond 0.05 m along 0 0 1, for tool\n"
        "set      post  out of 1 1 0 to 1.5 1.5 1 m, for tool, wrist, elbow\n"
        "set      cage  within -2 -2 -2 to 2 2 2 m, for wrist, elbow\n"
    )
    subprocess.check_call([*command, "--reset"])
    assert arm.workspace.further == ()
    arm.set_workspace(shapes[:1])
    arm.reset_workspace()
    assert arm.workspace.further == ()


def test_frames_hold_for_what_is_read_and_given(puma: corbot.Arm) -> None:
    before, profile = puma.state.tool, puma.frames
    longer = Pose(Point(0, 0, 0.1))
    puma.set_frames(tool=profile.tool @ longer)
    assert puma.state.tool.matrix == pytest.approx((before @ longer).matrix, abs=1e-6)
    stand = Pose(Point(1, 0, 0), Quaternion.about([0, 0, 1], 90))
    puma.set_frames(base=stand)
    assert puma.frames.base.matrix == pytest.approx(stand.matrix)
    puma.reset_frames()
    assert puma.frames == profile
    assert puma.state.tool.matrix == pytest.approx(before.matrix)


def test_every_solution_leads_to_the_pose(puma: corbot.Arm) -> None:
    puma.joints([20, -40, 160, -60, 40, 10])  # the wrist can be flipped within its range
    wanted = puma.state.tool
    solutions = puma.solutions(wanted)
    assert len(solutions) == 8
    assert puma.solution in {solution.number for solution in solutions}
    reachable = [solution for solution in solutions if solution.within_limits]
    assert len(reachable) > 1
    for solution in reachable[:3]:
        puma.joints(solution.joints)
        assert puma.state.tool.matrix == pytest.approx(wanted.matrix, abs=1e-6)
        assert puma.solution == solution.number
    with pytest.raises(corbot.Unreachable):
        puma.solutions(Pose(Point(5, 0, 0)))


def test_relative_turns_the_tool(puma: corbot.Arm) -> None:
    puma.joints([20, -40, 160, 10, 40, 10])
    before, turn = puma.state.tool, Quaternion.about([0, 0, 1], 15)
    puma.relative(turn=turn, frame="tool")
    assert puma.state.tool.matrix == pytest.approx((before @ Pose(Point(0, 0, 0), turn)).matrix, abs=1e-6)


def test_a_tool_orientation_holds_until_it_is_taken_back(puma: corbot.Arm) -> None:
    puma.joints([20, -40, 160, 10, 40, 10])
    wanted, at = puma.state.tool.orientation, puma.state.tool.position
    assert puma.tool_orientation is None
    puma.set_tool_orientation(wanted)
    assert puma.tool_orientation == pytest.approx(wanted)
    puma.relative(turn=Quaternion.about([0, 0, 1], 15), frame="tool")
    puma.move(at.x, at.y, at.z - 0.02)
    assert puma.state.tool.orientation == pytest.approx(wanted, abs=1e-6)
    puma.set_tool_orientation(None)
    assert puma.tool_orientation is None


def test_a_tool_pitch_inclines_the_tool(arm: corbot.Arm) -> None:
    arm.set_tool_pitch(-30)
    assert arm.tool_pitch == -30
    arm.move(0.18, 0.0, 0.05)
    assert (arm.state.tool.orientation @ (1, 0, 0))[2] == pytest.approx(np.sin(np.deg2rad(-30)), abs=1e-6)
    arm.set_tool_pitch(0)


def test_speeds_stretch_motions(arm: corbot.Arm) -> None:
    assert arm.speeds == corbot.Speeds(100, (100,) * 4)
    fast = arm.joints(FAR).info.duration
    arm.set_speeds(joints=50)
    assert arm.ready().info.duration > 1.3 * fast
    arm.set_speeds(tool=30, joints=[100, 90, 80, 70])
    assert arm.speeds == corbot.Speeds(30, (100, 90, 80, 70))
    arm.set_speeds(tool=100, joints=100)


def test_override_and_pause_hold_the_arm_on_its_path(arm: corbot.Arm) -> None:
    arm.override(50)
    assert arm.state.override == 50
    arm.override(100)
    motion = arm.joints(FAR, time=1, wait=False)
    arm.pause()
    assert arm.state.paused
    with pytest.raises(corbot.MotionTimeout):
        motion.wait(timeout=1.5)
    arm.resume()
    assert motion.wait().state is corbot.MotionState.DONE


def test_a_delay_takes_its_time(arm: corbot.Arm) -> None:
    assert arm.delay(0.3).info.duration == pytest.approx(0.3)


def test_what_serves_the_arm(arm: corbot.Arm) -> None:
    assert arm.kind == "Anthropomorphic"
    assert arm.reach == pytest.approx(0.34)
    assert arm.servant.version
    assert abs(time.time() - arm.servant.started) < 3600
    loop = arm.diagnostics
    until(lambda: arm.diagnostics.cycles > loop.cycles)
    assert len(loop.counts) == len(loop.edges)


def test_states_come_at_their_rate(arm: corbot.Arm) -> None:
    begun = time.monotonic()
    states = arm.states(50)
    times = [state.time for state in islice(states, 26)]
    assert time.monotonic() - begun > 0.49
    assert times == sorted(times)


def test_states_drop_what_is_late(arm: corbot.Arm) -> None:
    states = arm.states(100)
    next(states)
    time.sleep(0.8)
    asked = time.time()
    assert next(states).time > asked - 0.4  # none of those that were to come meanwhile
    assert states.dropped >= 45
    with pytest.raises(ValueError, match="at most 1000"):
        arm.states(0)


def test_states_end_when_another_thread_says_so(arm: corbot.Arm) -> None:
    states = arm.states(0.01)
    threading.Timer(0.2, states.end).start()
    assert len(list(states)) == 1
    assert list(states) == []
