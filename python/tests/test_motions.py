# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import asyncio
import contextlib
import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import corbot
from support import FAR, SLOWLY, is_at_rest, runs, until


def place(arm: corbot.Arm) -> tuple[float, float, float]:
    p = arm.state.tool.position
    return (p.x, p.y, p.z)


def test_move_goes_to_a_point_above_another(arm: corbot.Arm) -> None:
    arm.move(0.20, 0.05, 0.06, above=0.02)
    assert place(arm) == pytest.approx((0.20, 0.05, 0.08), abs=1e-6)


def test_a_motion_takes_its_time(arm: corbot.Arm) -> None:
    assert arm.joints(FAR, time=3.0).info.duration == pytest.approx(3.0)
    assert arm.move(0.20, 0.05, 0.08, time=2.0).info.duration == pytest.approx(2.0)


def test_a_time_that_the_limits_do_not_allow_is_lengthened(arm: corbot.Arm) -> None:
    assert arm.joints(FAR, time=0.01).duration > 0.3
    assert arm.joints([0, 0, 0, 0], time=3.0).duration == pytest.approx(3.0)


def test_line_arc_and_relative_end_where_they_say(arm: corbot.Arm) -> None:
    arm.move(0.20, 0.05, 0.09)
    arm.line(0.20, 0.0, 0.07, above=0.01)
    assert place(arm) == pytest.approx((0.20, 0.0, 0.08), abs=1e-6)
    arm.arc((0.20, 0.05, 0.09), corbot.Point(0.20, 0.0, 0.12), (0.20, -0.05, 0.09))
    assert place(arm) == pytest.approx((0.20, -0.05, 0.09), abs=1e-6)
    arm.relative(z=0.01, line=True)
    assert place(arm) == pytest.approx((0.20, -0.05, 0.10), abs=1e-6)


def test_relative_in_the_tool_frame_follows_the_tool(arm: corbot.Arm) -> None:
    arm.move(0.15, 0.15, 0.08)  # the tool points along the diagonal
    arm.relative(x=-0.02, frame="tool")
    x, y, _ = place(arm)
    assert x < 0.149
    assert x == pytest.approx(y, abs=1e-6)


def test_pose_goes_back_to_a_pose_that_was_read(arm: corbot.Arm) -> None:
    arm.move(0.20, 0.05, 0.08)
    before = arm.state.tool
    arm.ready()
    arm.pose(before)
    assert place(arm) == pytest.approx((0.20, 0.05, 0.08), abs=1e-6)


def test_drive_takes_a_joint_by_number_and_by_name(arm: corbot.Arm) -> None:
    arm.drive(0, 10, speed=40)
    arm.drive("shoulder", 5, speed=40)
    assert arm.state.joints == pytest.approx((10, 5, 0, 0), abs=1e-3)
    with pytest.raises(ValueError, match="base, shoulder, elbow, wrist"):
        arm.drive("sholder", 5, speed=40)


def test_ready_takes_all_joints_to_zero(arm: corbot.Arm) -> None:
    arm.joints([10, 10, 10, 10])
    arm.ready()
    assert arm.state.joints == pytest.approx((0, 0, 0, 0), abs=1e-3)


def test_the_gripper_opens_closes_and_stops_between(arm: corbot.Arm) -> None:
    arm.open()
    assert arm.state.gripper.commanded == pytest.approx(100, abs=0.01)
    arm.gripper(40)
    assert arm.state.gripper.commanded == pytest.approx(40, abs=0.01)
    arm.close()
    assert arm.state.gripper.commanded == pytest.approx(0, abs=0.01)


def test_a_motion_that_is_not_awaited_can_be_followed(arm: corbot.Arm) -> None:
    motion = arm.joints(FAR, time=3.0, wait=False)
    until(lambda: runs(motion))
    state = arm.state
    assert state.status is corbot.Status.WAITING
    assert state.motion is not None
    assert state.motion.number == motion.number
    assert 0 < motion.progress < 1
    assert motion.wait().state is corbot.MotionState.DONE
    assert motion.progress == 1


def test_wait_shows_a_bar(arm: corbot.Arm, capsys: pytest.CaptureFixture[str]) -> None:
    motion = arm.joints(FAR, time=3.0, wait=False)
    with pytest.raises(corbot.MotionTimeout):
        motion.wait(timeout=1.0, progress=True)
    before = capsys.readouterr().err
    motion.wait(progress=True)
    shares = [int(share) for share in re.findall(rf"motion {motion.number}: +(\d+)%\|", before)]
    assert len(shares) > 2, before
    assert shares == sorted(shares)
    assert 0 < shares[-1] < 100
    assert f"motion {motion.number}: 100%|" in capsys.readouterr().err


def test_without_tqdm_wait_shows_nothing(
    arm: corbot.Arm, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert arm.joints(FAR, time=0.3, wait=False).wait(progress=True).state is corbot.MotionState.DONE
    assert capsys.readouterr().err == ""


def test_wait_ends_in_time_and_the_motion_goes_on(arm: corbot.Arm) -> None:
    motion = arm.joints(FAR, time=SLOWLY, wait=False)
    with pytest.raises(corbot.MotionTimeout, match="goes on") as raised:
        motion.wait(timeout=0.25)
    assert (raised.value.number, raised.value.timeout) == (motion.number, 0.25)
    assert not motion.info.state.has_ended


def test_cancel_takes_back_the_motion_and_what_is_behind_it(arm: corbot.Arm) -> None:
    motion = arm.joints(FAR, time=SLOWLY, wait=False)
    behind = arm.ready(wait=False)
    motion.cancel()
    for ended in (motion, behind):
        with pytest.raises(corbot.Stopped, match=r"arm\.state"):
            ended.wait()


def test_stop_from_another_thread_ends_a_wait(arm: corbot.Arm) -> None:
    motion = arm.joints(FAR, time=SLOWLY, wait=False)
    until(lambda: runs(motion))
    threading.Thread(target=arm.stop).start()
    begun = time.monotonic()
    with pytest.raises(corbot.Stopped) as raised:
        motion.wait()
    assert time.monotonic() - begun < SLOWLY / 2
    assert raised.value.reason
    until(lambda: is_at_rest(arm), within=1.0)


def test_more_may_wait_than_the_servant_lets_wait(arm: corbot.Arm) -> None:
    motion = arm.joints(FAR, time=1.5, wait=False)
    with ThreadPoolExecutor(8) as pool:
        ends = list(pool.map(lambda _: motion.wait(), range(8)))
    assert {end.state for end in ends} == {corbot.MotionState.DONE}


def test_await_gives_the_end(arm: corbot.Arm) -> None:
    async def both() -> tuple[corbot.MotionInfo, float]:
        begun = time.monotonic()
        motion = arm.joints(FAR, time=0.5, wait=False)
        await asyncio.sleep(0)
        return await motion, time.monotonic() - begun

    info, took = asyncio.run(both())
    assert info.state is corbot.MotionState.DONE
    assert took > 0.3


def test_await_leaves_the_loop_to_others(arm: corbot.Arm) -> None:
    async def count() -> int:
        motion, turns = arm.joints(FAR, time=0.5, wait=False), 0
        task = asyncio.ensure_future(motion)
        while not task.done():
            await asyncio.sleep(0.01)
            turns += 1
        return turns

    assert asyncio.run(count()) > 3


def test_a_cancelled_await_stops_the_arm(arm: corbot.Arm) -> None:
    motion = arm.joints(FAR, time=SLOWLY, wait=False)

    async def impatient() -> None:
        await asyncio.wait_for(motion, timeout=0.2)

    with pytest.raises(asyncio.TimeoutError):
        asyncio.run(impatient())
    assert motion.info.state is corbot.MotionState.STOPPED


def test_an_exception_that_leaves_the_block_stops_the_arm(arm: corbot.Arm) -> None:
    with contextlib.suppress(ZeroDivisionError), corbot.connect(arm.address) as other:
        motion = other.joints(FAR, time=SLOWLY, wait=False)
        _ = 1 / 0
    assert motion.info.state is corbot.MotionState.STOPPED


def test_the_end_of_the_block_stops_nothing(arm: corbot.Arm) -> None:
    with corbot.connect(arm.address) as other:
        motion = other.joints(FAR, time=0.5, wait=False)
    assert motion.wait().state is corbot.MotionState.DONE
