# SPDX-License-Identifier: Apache-2.0
"""An arm by its URDF: the frames of its links and its tool, and its picture as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape  # xml.sax.saxutils would import urllib.request
from xml.etree import ElementTree

import numpy as np

from corbot.poses import Array, Point, Pose, Quaternion
from corbot.values import Shape

_ORIGIN = Pose(Point(0.0, 0.0, 0.0))


@dataclass(frozen=True)
class Joint:
    """A joint of the URDF.

    It has the frame of its child in that of its parent at value 0, and its axis in the child's frame.
    """

    name: str
    kind: str
    """`revolute`, `prismatic` or `fixed`."""
    origin: Pose
    axis: tuple[float, float, float]

    @property
    def moves(self) -> bool:
        """Whether it has a value."""
        return self.kind != "fixed"

    def at(self, value: float) -> Pose:
        """Give the frame of its child in that of its parent. Degrees, or metres for a sliding joint."""
        if self.kind == "fixed":
            return self.origin
        if self.kind == "prismatic":
            return self.origin @ Pose(Point(*(value * number for number in self.axis)))
        return self.origin @ Pose(Point(0.0, 0.0, 0.0), Quaternion.about(self.axis, value))


@dataclass(frozen=True)
class Model:
    """An arm described by a URDF, without an object in its gripper and without its place in the world."""

    name: str
    joints: tuple[Joint, ...]
    """From the base to the tool, fixed ones included."""

    @classmethod
    def from_urdf(cls, text: str) -> Model:
        """Read a URDF whose joints form one chain, like that of `Arm.description`."""
        robot = ElementTree.fromstring(text)
        by_parent = {_attribute(joint, "parent", "link"): joint for joint in robot.findall("joint")}
        link = (by_parent.keys() - {_attribute(joint, "child", "link") for joint in by_parent.values()}).pop()
        joints: list[Joint] = []
        while link in by_parent:
            joints.append(_joint_of(by_parent[link]))
            link = _attribute(by_parent[link], "child", "link")
        return cls(robot.get("name", ""), tuple(joints))

    @property
    def moving(self) -> tuple[Joint, ...]:
        """The joints that have a value, in the order of all lists of them."""
        return tuple(joint for joint in self.joints if joint.moves)

    def frames(self, joints: Sequence[float] | Array) -> list[Pose]:
        """Give the frames of all links in the base frame, from the base to the tool.

        Joint values are in degrees (metres).
        """
        if len(joints) != len(self.moving):
            raise ValueError(f"The arm has {len(self.moving)} joints, and these are {len(joints)} values.")
        values, frames = iter(joints), [Pose(Point(0.0, 0.0, 0.0))]
        for joint in self.joints:
            frames.append(frames[-1] @ joint.at(next(values) if joint.moves else 0.0))
        return frames

    def forward(self, joints: Sequence[float] | Array) -> Pose:
        """Give the tool's pose in the base frame for joint values in degrees (metres)."""
        return self.frames(joints)[-1]

    def svg(
        self,
        joints: Sequence[float] | Array,
        shapes: Iterable[Shape] = (),
        base: Pose = _ORIGIN,
    ) -> str:
        """Draw the arm as SVG: links, joints, the tool's axes, and the shadow on the floor.

        It draws the faces of planes and boxes near the arm, too. The shapes are in the frame in which
        the arm has the pose `base`.
        """
        frames = self.frames(joints)
        links = np.array([frame.position for frame in frames])
        size = max(float(np.abs(links).max()), 1e-3)
        near = np.array((links.min(axis=0), links.max(axis=0))) + 0.2 * size * np.array([[-1.0], [1.0]])
        faces = [face for shape in shapes for face in _faces(shape, base, near)]
        tool = frames[-1] @ (0.15 * size * np.vstack((np.zeros(3), np.eye(3))))
        floor = links * (1.0, 1.0, 0.0)
        picture = _Picture(np.vstack((links, floor, tool, *faces)))
        at = [index + 1 for index, joint in enumerate(self.joints) if joint.moves]
        parts = [
            *(picture.face(face) for face in faces),
            picture.line(floor, "#d7dbe0", 7.0),
            picture.line(links, "#3b4a5a", 7.0),
            *(
                picture.line(tool[[0, axis]], colour, 2.5)
                for axis, colour in ((1, "#d62728"), (2, "#2ca02c"), (3, "#1f77b4"))
            ),
            *(picture.circle(links[index]) for index in at),
        ]
        return picture.document(self.name, parts, _captions(self.moving, joints))


class _Picture:
    """A parallel projection, from the upper right, scaled to fit its content."""

    WIDTH, HEIGHT, MARGIN, LINE = 420.0, 320.0, 24.0, 18.0  # pixels

    def __init__(self, points: Array) -> None:
        turn, rise = np.deg2rad(-60.0), np.deg2rad(20.0)
        self._right = np.array((-np.sin(turn), np.cos(turn), 0.0))
        self._down = np.array((np.cos(turn) * np.sin(rise), np.sin(turn) * np.sin(rise), -np.cos(rise)))
        flat = np.column_stack((points @ self._right, points @ self._down))
        low, extent = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-3)
        room = np.array((self.WIDTH, self.HEIGHT)) - 2.0 * self.MARGIN
        self._scale = float((room / extent).min())
        self._offset = self.MARGIN + (room - self._scale * extent) / 2.0 - self._scale * low

    def _at(self, points: Array) -> Array:
        flat: Array = (
            np.column_stack((points @ self._right, points @ self._down)) * self._scale + self._offset
        )
        return flat

    def line(self, points: Array, colour: str, width: float) -> str:
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in self._at(points))
        style = (
            f'fill="none" stroke="{colour}" stroke-width="{width:g}" '
            'stroke-linecap="round" stroke-linejoin="round"'
        )
        return f'<polyline points="{corners}" {style}/>'

    def face(self, corners: Array) -> str:
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in self._at(corners))
        return f'<polygon points="{points}" fill="#cc79a7" fill-opacity="0.2" stroke="#cc79a7"/>'

    def circle(self, point: Array) -> str:
        ((x, y),) = self._at(point[np.newaxis])
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="#f2a33a" stroke="#3b4a5a" stroke-width="2"/>'

    def document(self, title: str, parts: Iterable[str], captions: Sequence[str]) -> str:
        height = self.HEIGHT + self.LINE * len(captions) + self.MARGIN / 2.0
        texts = "\n".join(
            f'<text x="{self.MARGIN:g}" y="{self.HEIGHT + self.LINE * (row + 0.5):g}">'
            f"{escape(caption)}</text>"
            for row, caption in enumerate(captions)
        )
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.WIDTH:g}" height="{height:g}" '
            f'viewBox="0 0 {self.WIDTH:g} {height:g}" font-family="sans-serif" font-size="13">\n'
            f'<title>{escape(title)}</title>\n<rect width="100%" height="100%" rx="6" fill="#ffffff"/>\n'
            + "\n".join(parts)
            + f"\n{texts}\n</svg>\n"
        )


def _faces(shape: Shape, base: Pose, near: Array) -> list[Array]:
    """Give the faces of a plane or box in the frame of the arm, as far as they are near."""
    if shape.kind == "plane":
        normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
        right = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        right /= np.linalg.norm(right)
        up = np.cross(normal, right)
        middle = base @ near.mean(axis=0)
        middle = middle + (shape.offset - middle @ normal) * normal
        wide = float(np.linalg.norm(near[1] - near[0]))
        faces = [middle + wide * np.array((-right - up, right - up, right + up, up - right))]
    else:
        ends = np.array((shape.least, shape.greatest))
        square = ((0, 0), (1, 0), (1, 1), (0, 1))
        faces = []
        for axis in range(3):
            for end in (0, 1):
                corners = [np.insert((a, b), axis, end) for a, b in square]
                faces.append(np.array([ends[corner, range(3)] for corner in corners]))
    drawn = [_cut_to(base.inverse @ face, near) for face in faces]
    return [face for face in drawn if len(face) > 2]


def _cut_to(face: Array, near: Array) -> Array:
    """Cut a convex polygon to a box between two corners."""
    for axis in range(3):
        for sign, bound in ((1.0, near[1][axis]), (-1.0, -near[0][axis])):
            kept: list[Array] = []
            for start, end in zip(face, np.roll(face, -1, axis=0), strict=True):
                before, after = bound - sign * start[axis], bound - sign * end[axis]
                if before >= 0.0:
                    kept.append(start)
                if (before >= 0.0) != (after >= 0.0):
                    kept.append(start + before / (before - after) * (end - start))
            face = np.array(kept).reshape(-1, 3)
    return face


def _captions(joints: Sequence[Joint], values: Sequence[float] | Array) -> list[str]:
    texts = [
        f"{joint.name} {1000.0 * value + 0.0:.1f} mm"
        if joint.kind == "prismatic"
        else f"{joint.name} {value + 0.0:.1f}°"
        for joint, value in zip(joints, values, strict=True)
    ]
    return ["   ".join(texts[row : row + 3]) for row in range(0, len(texts), 3)]


def _attribute(element: ElementTree.Element, path: str, name: str) -> str:
    found = element.find(path)
    return "" if found is None else found.get(name, "")


def _numbers(text: str) -> list[float]:
    return [float(number) for number in text.split()] if text else [0.0, 0.0, 0.0]


def _joint_of(element: ElementTree.Element) -> Joint:
    roll, pitch, yaw = np.rad2deg(_numbers(_attribute(element, "origin", "rpy")))
    x, y, z = _numbers(_attribute(element, "origin", "xyz"))
    turn = (
        Quaternion.about((0, 0, 1), yaw)
        @ Quaternion.about((0, 1, 0), pitch)
        @ Quaternion.about((1, 0, 0), roll)
    )
    a, b, c = _numbers(_attribute(element, "axis", "xyz"))
    return Joint(element.get("name", ""), element.get("type", ""), Pose(Point(x, y, z), turn), (a, b, c))
