# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import pickle
from types import SimpleNamespace

import numpy as np
import pytest

import corbot
from support import FAR, SLOWLY


def test_a_value_that_no_robot_takes(arm: corbot.Arm) -> None:
    with pytest.raises(corbot.BadParameter, match="Nothing moved. Correct the argument") as raised:
        arm.move(0.2, 0.05, 5000.0)
    assert (raised.value.parameter, raised.value.value) == ("Pz", 5000.0)
    assert "Pz" in str(raised.value)
    assert isinstance(raised.value, ValueError)


def test_a_parameter_is_named_once() -> None:
    assert str(corbot.BadParameter("t", -1.0, "must not be negative")).startswith("T = -1: must not")
    assert str(corbot.BadParameter("P2", 0.0, "P1 and P2 are 0 m apart")).startswith("P1 and P2 are")


@pytest.mark.parametrize(
    ("name", "fix"), [("override", "call arm.override"), ("stop", "call arm.stop"), ("speed", "no 'speed'")]
)
def test_a_value_by_assignment(arm: corbot.Arm, name: str, fix: str) -> None:
    with pytest.raises(AttributeError, match=fix):
        setattr(arm, name, 20)


def test_a_point_out_of_reach(arm: corbot.Arm) -> None:
    with pytest.raises(corbot.Unreachable, match="too far.*Nothing moved.*20 cm is 0.20") as raised:
        arm.move(0.9, 0.0, 0.1)
    assert raised.value.target == corbot.Point(0.9, 0.0, 0.1)


def test_a_joint_beyond_its_range(arm: corbot.Arm) -> None:
    with pytest.raises(corbot.LimitExceeded, match="joint range of joint 3: 500 is not within") as raised:
        arm.joints([0, 0, 0, 500])
    e = raised.value
    assert (e.quantity, e.joint, e.value) == ("joint range", 3, 500.0)
    assert e.lower < e.upper < 500


def test_a_limit_has_its_unit(arm: corbot.Arm) -> None:
    with pytest.raises(
        corbot.LimitExceeded, match=r"500 is not within \S+ to \S+ degrees\. Nothing moved"
    ) as raised:
        arm.joints([0, 0, 0, 500])
    assert raised.value.unit == "degrees"
    with pytest.raises(
        corbot.LimitExceeded, match=r"speed of joint 0: 5000 is not within 0 to \S+ degrees a second\."
    ):
        arm.drive("base", 5, speed=5000)
    assert "to 5 m. Nothing" in str(corbot.LimitExceeded("joint range", 1, 9.0, 0.0, 5.0, "m"))
    assert str(corbot.LimitExceeded("workspace: the tool would be 9 mm low", -1, -0.009, 0.0, 1000.0)) == (
        "The tool would be 9 mm low. Nothing moved."
    )
    assert "to 3600 s. Nothing" in str(corbot.LimitExceeded("duration", -1, 4000.0, 0.0, 3600.0))


def test_a_full_queue(arm: corbot.Arm) -> None:
    accepted: list[corbot.Motion] = []
    with pytest.raises(corbot.QueueFull, match="Try again when one has ended") as raised:
        while len(accepted) < 1000:
            accepted.append(arm.joints(FAR, time=SLOWLY, wait=False))
    assert len(accepted) == raised.value.capacity


def test_a_hold_until_it_is_cleared(arm: corbot.Arm) -> None:
    arm.call("StopAndHold")
    assert arm.state.status is corbot.Status.ERROR
    assert arm.state.control.held
    with pytest.raises(corbot.NotReady, match=r"arm\.clear\(\)") as raised:
        arm.ready()
    assert raised.value.reason
    arm.clear()
    arm.ready()
    assert arm.alarms[-1].time > 0
    assert arm.alarms[-1].text


def test_a_setting_while_somebody_has_control(arm: corbot.Arm) -> None:
    with (
        arm.control("Ada"),
        pytest.raises(corbot.NoControl, match="Another client has exclusive control") as raised,
    ):
        corbot.connect(arm.address).call("Speed", 50.0)
    assert not raised.value.has_ended


def test_arguments_that_the_interface_cannot_carry_are_named(arm: corbot.Arm) -> None:
    with pytest.raises(TypeError, match="a text, and no number"):
        arm.call("StartDelay", "a text, and no number")
    with pytest.raises(ValueError, match="has 4 joints"):
        arm.set_speeds(joints=[50, 50])


def test_an_operation_that_is_none_is_named(arm: corbot.Arm) -> None:
    with pytest.raises(AttributeError, match=r"Corbot::Arm has no operation 'Overide'\. Nothing moved\."):
        arm.call("Overide", 50.0)


def test_a_camera_is_refused_where_its_port_would_not_open(
    arm: corbot.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    def sleep(_: float) -> None:
        pytest.fail("the camera waits for calls at a port that nothing opened")

    monkeypatch.setattr("corbot.camera.time", SimpleNamespace(sleep=sleep))
    camera = SimpleNamespace(look=lambda _: [], picture=lambda _: b"")
    with pytest.raises(RuntimeError, match=r"Port 12345 would not be open.* process of its own"):
        corbot.serve_camera(camera, 12345)
    assert arm.state.status is corbot.Status.STANDBY


def test_more_values_than_any_arm_has_joints_reach_no_robot(arm: corbot.Arm, reached: set[str]) -> None:
    with pytest.raises(
        ValueError, match=r"These are 7 values, and an arm has at most 6 joints\. Nothing moved"
    ) as raised:
        arm.joints([0] * 7)
    assert not isinstance(raised.value, corbot.CorbotError)
    with pytest.raises(ValueError, match="These are 9 values"):
        arm.set_limits([(-10, 10)] * 9)
    assert reached == set()
    with pytest.raises(TypeError, match=r"does not take a list of such a length: \(\[0.0,"):
        arm.call("StartMoveJoints", [0.0] * 7, 0.0)


def test_a_wrong_number_of_values_says_how_many_the_arm_takes(arm: corbot.Arm) -> None:
    for values in ([0] * 3, [0] * 5):
        with pytest.raises(corbot.BadParameter, match="4") as raised:
            arm.joints(values)
        assert (raised.value.parameter, raised.value.value) == ("target", len(values))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        ("arm.joints('1234')", "TypeError: '1' is a text where a number is expected."),
        ("arm.joints({'base': 10})", "TypeError: 'base' is a text where a number is expected."),
        ("arm.move('0.2', 0.05, 0.08)", "TypeError: '0.2' is a text where a number is expected."),
        (
            "arm.arc((0.2, 0, 0.1), (0.2, 0), (0.2, 0.1, 0.1))",
            "ValueError: A point is three numbers, x, y and z, not (0.2, 0).",
        ),
        ("arm.arc(1, 2, 3)", "ValueError: A point is three numbers, x, y and z, not 1."),
        (
            "arm.pose((0.2, 0, 0.1))",
            "TypeError: A pose is a corbot.Pose, not (0.2, 0, 0.1). Pose.from_matrix makes one",
        ),
        ("arm.set_frames(tool=numpy.eye(4))", "TypeError: A pose is a corbot.Pose, not array("),
        ("arm.relative(z=0.01, turn=30)", "ValueError: A rotation is a corbot.Quaternion, not 30."),
        ("arm.relative(z=0.01, turn=0)", "ValueError: A rotation is a corbot.Quaternion, not 0."),
        (
            "arm.relative(z=0.01, frame='world')",
            "ValueError: A frame is 'base' or 'tool', not 'world'. Nothing moved.",
        ),
        ("arm.set_limits([-10, 10, 0, 0])", "ValueError: A range is a lower and an upper limit, not -10."),
        ("arm.drive(1.5, 5, speed=10)", "TypeError: 'float' object cannot be interpreted as an integer"),
        (
            "arm.set_speeds(joints=[100, 100, 100, '1'])",
            "TypeError: '1' is a text where a number is expected.",
        ),
        ("arm.set_speeds(tool=30, joints='50')", "TypeError: '50' is a text where a number is expected."),
        ("arm.set_speeds(tool='30')", "TypeError: '30' is a text where a number is expected."),
        ("arm.set_frames(tool=corbot.Pose((0, 0, 0.1)), base=5)", "TypeError: A pose is a corbot.Pose"),
        ("arm.control('Ada', lease='5').__enter__()", "TypeError: '5' is a text where a number is expected."),
        *(
            (f"arm.{call}", "TypeError: '5' is a text where a number is expected.")
            for call in (
                "pose(corbot.Pose((0.2, 0, 0.1)), time='5')",
                "relative(z=0.01, time='5')",
                "joints([0, 0, 0, 0], time='5')",
                "drive(0, '5', speed=10)",
                "drive(0, 5, speed='5')",
                "gripper('5')",
                "delay('5')",
                "override('5')",
                "set_tool_pitch('5')",
            )
        ),
    ],
)
def test_what_is_no_argument_reaches_no_robot(
    call: str, text: str, arm: corbot.Arm, reached: set[str]
) -> None:
    with pytest.raises((TypeError, ValueError)) as raised:
        eval(call, {"arm": arm, "numpy": np, "corbot": corbot})
    assert f"{type(raised.value).__name__}: {raised.value}".startswith(text)
    assert reached == set()


def test_numbers_of_numpy_are_numbers(arm: corbot.Arm) -> None:
    arm.drive(np.int64(1), np.float32(5), speed=np.int32(10))  # type: ignore[arg-type]
    arm.joints(np.array([0, 5, 0, 0]))
    assert arm.state.joints == pytest.approx((0, 5, 0, 0), abs=1e-3)
    arm.set_speeds(joints=np.int64(50))  # type: ignore[arg-type]
    assert arm.speeds.joints == (50, 50, 50, 50)
    arm.set_speeds(joints=np.array(60.0))
    assert arm.speeds.joints == (60, 60, 60, 60)
    arm.set_speeds(joints=np.full(4, 100))
    assert arm.speeds.joints == (100, 100, 100, 100)


@pytest.mark.parametrize(
    "error",
    [
        corbot.BadParameter("t", -1.0, "less than 0"),
        corbot.Unreachable(corbot.Point(9.0, 0.0, 0.0), "too far"),
        corbot.LimitExceeded("speed", 1, 9.0, 0.0, 5.0),
        corbot.RobotNotFound("lynx5", "nobody answers there"),
        corbot.MotionTimeout(3, 0.5),
        corbot.NotOffered("corbaloc::somewhere", "_get_State"),
    ],
)
def test_an_exception_of_another_process_arrives(error: corbot.CorbotError) -> None:
    arrived = pickle.loads(pickle.dumps(error))
    assert type(arrived) is type(error)
    assert str(arrived) == str(error) != ""
    assert vars(arrived) == vars(error) != {}
