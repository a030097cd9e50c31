# SPDX-License-Identifier: Apache-2.0
"""The arm by its description, its picture, and recordings."""

from __future__ import annotations

import os
import signal
import sys
import time
from xml.etree import ElementTree

import numpy as np
import pytest

import corbot
from conftest import Robot
from support import FAR, until

SVG = "{http://www.w3.org/2000/svg}"


def some_joints(arm: corbot.Arm, random: np.random.Generator) -> list[float]:
    return [float(random.uniform(limit.lower / 3, limit.upper / 3)) for limit in arm.limits]


@pytest.mark.parametrize("simulated_arm", ["lynx5", "puma560", "scara_gx4"], indirect=True)
def test_the_model_has_the_tool_where_the_robot_has_it(simulated_arm: corbot.Arm) -> None:
    random = np.random.default_rng(3)
    for _ in range(3):
        simulated_arm.joints(some_joints(simulated_arm, random))
        state = simulated_arm.state
        assert simulated_arm.model.forward(state.joints).matrix == pytest.approx(state.tool.matrix, abs=1e-6)
    assert [joint.name for joint in simulated_arm.model.moving] == list(simulated_arm.joint_names)
    ElementTree.fromstring(simulated_arm._repr_svg_())


def test_the_picture_shows_the_arm_as_it_stands(arm: corbot.Arm) -> None:
    before = arm._repr_svg_()
    arm.joints([30, 20, -10, 0])
    after = ElementTree.fromstring(arm._repr_svg_())
    assert arm._repr_svg_() != before
    assert len(after.findall(f"{SVG}circle")) == 4
    shadow, links, *axes = (line.get("points", "").split() for line in after.findall(f"{SVG}polyline"))
    assert len(shadow) == len(links) == len(arm.model.joints) + 1
    assert {axis[0] for axis in axes} == {links[-1]}  # the tool's axes begin at the tool
    texts = [text.text or "" for text in after.findall(f"{SVG}text")]
    assert "base 30.0°   shoulder 20.0°   elbow -10.0°" in texts
    assert all(0 <= float(number) <= 420 for corner in links for number in corner.split(","))


def corners_of(arm: corbot.Arm) -> list[list[tuple[float, float]]]:
    faces = ElementTree.fromstring(arm._repr_svg_()).findall(f"{SVG}polygon")
    corners = (face.get("points", "").split() for face in faces)
    return [[(float(x), float(y)) for x, y in (corner.split(",") for corner in face)] for face in corners]


def test_the_picture_shows_planes_and_boxes_near_the_arm(arm: corbot.Arm) -> None:
    arm.joints([0, 0, 0, 0])
    assert corners_of(arm) == []
    shapes = [
        corbot.Shape.plane("floor2", (0, 0, 1), 0.0),
        corbot.Shape.box("post", (0.2, 0.02, 0.0), (0.25, 0.05, 0.1)),
        corbot.Shape.box("far", (5, 5, 0), (6, 6, 1)),
        corbot.Shape.plane("wall", (0, 2, 0), -0.05),
    ]
    arm.set_workspace(shapes)
    try:
        shown = corners_of(arm)
        assert len(shown) == 1 + 6 + 1
        assert all(0 <= x <= 420 and 0 <= y <= 320 for face in shown for x, y in face)
        arm.set_frames(base=corbot.Pose(corbot.Point(4.65, 5.1, 0.0)))
        assert corners_of(arm) == [], "they hold for the previous base"
        arm.set_workspace(shapes)
        assert len(corners_of(arm)) > 1  # the far box is near the arm, the post and the wall are far
        assert corners_of(arm) != shown
    finally:
        arm.reset_frames()
        arm.reset_workspace()


def test_a_wrong_number_of_joints_is_refused(arm: corbot.Arm) -> None:
    with pytest.raises(ValueError, match="has 4 joints, and these are 3"):
        arm.model.forward([0, 0, 0])


def test_a_recording_has_the_whole_motion(arm: corbot.Arm) -> None:
    for _ in range(5):
        arm.joints([0, 0, 0, 0])
        with corbot.record(arm, rate=50) as run:
            arm.joints(FAR, time=1)
        if np.diff(run.time).max() < 0.1:  # else the machine stood still
            break
    assert len(run) + run.dropped >= 45
    assert run.time.shape == (len(run),)
    assert run.joints.shape == run.commanded.shape == run.speeds.shape == (len(run), 4)
    assert run.joints[0] == pytest.approx((0, 0, 0, 0), abs=1e-3)
    assert run.joints[-1] == pytest.approx(FAR, abs=1e-3)
    assert run.time[0] == 0
    assert (np.diff(run.time) >= 0).all()
    turned = np.sum((run.speeds[1:, 0] + run.speeds[:-1, 0]) / 2 * np.diff(run.time))
    assert turned == pytest.approx(60, abs=3)  # degrees: the integral of the speed
    assert run.tool[-1] == pytest.approx(arm.state.tool.position)
    assert run.quaternions[-1] == pytest.approx(arm.state.tool.orientation)


def test_a_recording_without_a_reading_is_empty(arm: corbot.Arm) -> None:
    run = corbot.record(arm)
    assert run.joints.shape == run.commanded.shape == run.speeds.shape == (0, 4)
    assert (run.time.shape, run.tool.shape, run.quaternions.shape) == ((0,), (0, 3), (0, 4))
    assert len(run.plot().axes) == 2


def test_a_slow_recording_ends_with_its_block(arm: corbot.Arm) -> None:
    begun = time.monotonic()
    with corbot.record(arm, rate=0.05) as run:
        until(lambda: len(run) == 1)  # the next reading is due in 20 s
    assert time.monotonic() - begun < 10


def test_a_plot_shows_joints_speeds_and_limits(arm: corbot.Arm) -> None:
    with corbot.record(arm) as run:
        arm.joints(FAR, time=0.3)
    joints, speeds = run.plot().axes
    assert [text.get_text() for text in joints.get_legend().get_texts()] == list(  # type: ignore[union-attr]
        arm.joint_names
    )
    assert joints.lines[0].get_ydata() == pytest.approx(run.joints[:, 0])
    assert [line.get_ydata()[0] for line in joints.lines[1:3]] == [-90, 90]  # type: ignore[index]
    assert speeds.lines[2].get_ydata()[0] == arm.limits[0].speed  # type: ignore[index]


@pytest.mark.parametrize("simulated_arm", ["scara_gx4"], indirect=True)
def test_a_plot_has_axes_of_their_own_for_joints_that_slide(simulated_arm: corbot.Arm) -> None:
    with corbot.record(simulated_arm) as run:
        simulated_arm.drive("shaft", -0.02, speed=0.1)
    assert [axes.get_ylabel()[-4:] for axes in run.plot().axes] == [" (°)", "°/s)", " (m)", "m/s)"]


def test_without_matplotlib_a_plot_says_what_to_do(arm: corbot.Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    with corbot.record(arm) as run:
        pass
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ModuleNotFoundError, match="pip install matplotlib"):
        run.plot()


def test_a_robot_that_dies_ends_the_recording(fresh: Robot) -> None:
    with pytest.raises((corbot.Disconnected, corbot.RobotNotFound)), corbot.record(fresh.arm) as run:
        until(lambda: len(run) > 0)
        os.kill(fresh.simulation.processes["servant_pid"], signal.SIGKILL)
        run._thread.join(10)
