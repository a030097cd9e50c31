# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from corbot import Point, Pose, Quaternion

RANDOM = np.random.default_rng(8)


def some_rotation() -> Quaternion:
    return Quaternion.about(RANDOM.normal(size=3), float(RANDOM.uniform(-360, 360)))


def some_pose() -> Pose:
    return Pose(Point(*RANDOM.normal(size=3)), some_rotation())


def test_a_matrix_and_back() -> None:
    for _ in range(200):
        pose = some_pose()
        again = Pose.from_matrix(pose.matrix)
        assert again.position == pytest.approx(pose.position)
        assert again.orientation == pytest.approx(pose.orientation, abs=1e-9)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -1, 2)])
@pytest.mark.parametrize("degrees", [0, 1e-6, 90, 179.999999, 180])
def test_a_matrix_at_each_angle(axis: tuple[int, int, int], degrees: float) -> None:
    turn = Quaternion.about(axis, degrees)
    assert Quaternion.from_matrix(turn.matrix).matrix == pytest.approx(turn.matrix, abs=1e-9)
    assert turn.degrees == pytest.approx(degrees, abs=1e-9)
    assert turn.w >= 0


def test_a_product_is_that_of_the_matrices() -> None:
    for _ in range(50):
        a, b = some_pose(), some_pose()
        assert (a @ b).matrix == pytest.approx(a.matrix @ b.matrix)
        assert (a @ a.inverse).matrix == pytest.approx(np.eye(4), abs=1e-9)


def test_a_pose_takes_points_to_where_they_are() -> None:
    quarter = Pose(Point(1, 0, 0), Quaternion.about([0, 0, 2], 90))
    assert quarter @ (1, 0, 0) == pytest.approx((1, 1, 0))
    many = RANDOM.normal(size=(5, 3))
    assert quarter @ many == pytest.approx(many @ quarter.matrix[:3, :3].T + np.array((1, 0, 0)))


def test_what_is_no_rotation_is_refused() -> None:
    for wrong in (2 * np.eye(3), np.diag([1, 1, -1]), np.eye(2), np.full((3, 3), np.nan)):
        with pytest.raises(ValueError, match="rotation"):
            Quaternion.from_matrix(wrong)
    for wrong in (np.eye(3), np.ones((4, 4))):
        with pytest.raises(ValueError, match="0 0 0 1"):
            Pose.from_matrix(wrong)
    with pytest.raises(ValueError, match="not all zero"):
        Quaternion.about([0, 0, 0], 90)
    with pytest.raises(ValueError, match="finite numbers"):
        Quaternion.about([0, 0, np.inf], 90)
    with pytest.raises(ValueError, match="finite number of degrees, not nan"):
        Quaternion.about([0, 0, 1], np.nan)


def test_numpy_reads_them() -> None:
    assert np.array(Point(1, 2, 3)).tolist() == [1, 2, 3]
    assert Pose(Point(1, 2, 3)).quaternion.tolist() == [1, 0, 0, 0]
