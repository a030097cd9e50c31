# SPDX-License-Identifier: Apache-2.0
"""Positions, rotations and poses that convert from and to numpy. Metres; angles in degrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias, overload

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
_EXACT = 1e-6  # as required of a quaternion by the interface


class Point(NamedTuple):
    """A position in the base frame, metres. `numpy.array(point)` gives its three numbers."""

    x: float
    y: float
    z: float


class Quaternion(NamedTuple):
    """A rotation, of unit length; the identity by default. `a @ b` rotates by b first, then by a."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    @classmethod
    def about(cls, axis: npt.ArrayLike, degrees: float) -> Quaternion:
        """Give the rotation about an axis, whose length does not matter, by an angle in degrees."""
        direction = np.asarray(axis, dtype=np.float64)
        length = float(np.linalg.norm(direction))
        if direction.shape != (3,) or not 0.0 < length < np.inf:
            raise ValueError(f"An axis has three finite numbers that are not all zero, not {axis!r}.")
        if not np.isfinite(degrees):
            raise ValueError(f"An angle is a finite number of degrees, not {degrees!r}.")
        half = np.deg2rad(degrees) / 2.0
        return cls._of(np.concatenate(([np.cos(half)], np.sin(half) * direction / length)))

    @classmethod
    def from_matrix(cls, matrix: npt.ArrayLike) -> Quaternion:
        """Give the rotation of a 3 by 3 matrix; ValueError if the matrix is not a rotation within 1e-6."""
        r = np.asarray(matrix, dtype=np.float64)
        if (
            r.shape != (3, 3)
            or not np.allclose(r @ r.T, np.eye(3), rtol=0.0, atol=_EXACT)
            or np.linalg.det(r) < 0.0
        ):
            raise ValueError(f"This is not the matrix of a rotation:\n{r}")
        # The quaternion is the eigenvector of the largest eigenvalue (Bar-Itzhack 2000). The method is exact
        # at every angle.
        antisymmetric = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        k = np.empty((4, 4))
        k[0, 0], k[0, 1:], k[1:, 0] = np.trace(r), antisymmetric, antisymmetric
        k[1:, 1:] = r + r.T - np.trace(r) * np.eye(3)
        return cls._of(np.linalg.eigh(k)[1][:, -1])

    @property
    def matrix(self) -> Array:
        """The rotation as a 3 by 3 matrix."""
        w, v = self.w, np.array([self.x, self.y, self.z])
        cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
        turned: Array = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
        return turned

    @property
    def inverse(self) -> Quaternion:
        """The inverse rotation."""
        return Quaternion(self.w, -self.x, -self.y, -self.z)

    @property
    def degrees(self) -> float:
        """The angle of the rotation, 0 to 180 degrees."""
        return float(np.rad2deg(2.0 * np.arctan2(np.linalg.norm(self[1:]), abs(self.w))))

    @overload
    # A quaternion is a tuple, too, and so the overloads overlap.
    def __matmul__(self, other: Quaternion) -> Quaternion: ...  # type: ignore[overload-overlap]
    @overload
    def __matmul__(self, other: npt.ArrayLike) -> Array: ...
    def __matmul__(self, other: Any) -> Any:
        """Give the product with a rotation, or rotate a vector or the rows of an array of vectors."""
        if not isinstance(other, Quaternion):
            return np.asarray(other, dtype=np.float64) @ self.matrix.T
        a, b = np.array(self[1:]), np.array(other[1:])
        vector = self.w * b + other.w * a + np.cross(a, b)
        return Quaternion._of(np.concatenate(([self.w * other.w - a @ b], vector)))

    @classmethod
    def _of(cls, wxyz: Array) -> Quaternion:
        """Give a quaternion of exactly unit length, with w not negative, like the interface."""
        unit = wxyz / np.linalg.norm(wxyz)
        return cls(*(float(number) for number in (-unit if unit[0] < 0.0 else unit)))


_NO_TURN = Quaternion()


@dataclass(frozen=True)
class Pose:
    """A position in metres, and the orientation of a frame, such as the tool's in the base frame.

    `a @ b` is the pose b, given in the frame a, in the frame of a. `pose @ points` transforms points out of
    the frame.
    """

    position: Point
    orientation: Quaternion = _NO_TURN

    @classmethod
    def from_matrix(cls, matrix: npt.ArrayLike) -> Pose:
        """Give the pose of a homogeneous 4 by 4 matrix; ValueError if it is not a pose within 1e-6."""
        m = np.asarray(matrix, dtype=np.float64)
        if m.shape != (4, 4) or not np.allclose(m[3], (0.0, 0.0, 0.0, 1.0), rtol=0.0, atol=_EXACT):
            raise ValueError(
                f"This is not a homogeneous matrix of 4 by 4 numbers with the last row 0 0 0 1:\n{m}"
            )
        return cls(_point_of(m[:3, 3]), Quaternion.from_matrix(m[:3, :3]))

    @property
    def matrix(self) -> Array:
        """The pose as a homogeneous 4 by 4 matrix."""
        m = np.eye(4)
        m[:3, :3], m[:3, 3] = self.orientation.matrix, self.position
        return m

    @property
    def quaternion(self) -> Array:
        """The orientation as an array w, x, y, z."""
        return np.array(self.orientation)

    @property
    def inverse(self) -> Pose:
        """The pose of the outer frame in this one."""
        back = self.orientation.inverse
        return Pose(_point_of(-(back @ self.position)), back)

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: npt.ArrayLike) -> Array: ...
    def __matmul__(self, other: Any) -> Any:
        """Give the product with a pose, or transform a point or the rows of an array of points."""
        if isinstance(other, Pose):
            return Pose(_point_of(self @ other.position), self.orientation @ other.orientation)
        return (self.orientation @ other) + np.array(self.position)


def _point_of(xyz: Array) -> Point:
    return Point(*(float(number) for number in xyz))
