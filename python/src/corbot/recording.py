# SPDX-License-Identifier: Apache-2.0
"""The motion of an arm within a block, as arrays."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from corbot.arm import Arm
from corbot.errors import CorbotError
from corbot.poses import Array
from corbot.values import State

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def record(arm: Arm, rate: float = 100.0) -> Recording:
    """Record the arm within a block, `rate` readings a second.

    Example: `with corbot.record(arm) as run: ...`, then `run.joints`.
    """
    return Recording(arm, rate)


class Recording:
    """The readings of one block, a row of each array for each reading; a thread of its own takes them."""

    def __init__(self, arm: Arm, rate: float) -> None:
        self._arm, self._states = arm, arm.states(rate)
        self._limits = arm.limits
        self._taken: list[State] = []
        self._failure: CorbotError | None = None
        self._thread = threading.Thread(target=self._take, daemon=True)

    def __enter__(self) -> Recording:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self._states.end()  # Ctrl-C in the block stops the arm after this
        self._thread.join()
        if self._failure is not None and error is None:
            raise self._failure

    def __len__(self) -> int:
        return len(self._taken)

    @property
    def dropped(self) -> int:
        """The number of readings that were late and therefore omitted."""
        return self._states.dropped

    @property
    def time(self) -> Array:
        """The time of each reading, seconds since the first."""
        times: Array = np.array([state.time for state in self._taken])
        begin = times[0] if len(times) else 0.0
        return np.subtract(times, begin)

    @property
    def joints(self) -> Array:
        """The joints: degrees, or metres for a sliding joint, one column each.

        Measured if the device measures them.
        """
        return _rows([state.joints for state in self._taken], len(self._limits))

    @property
    def commanded(self) -> Array:
        """The set-points of the joints."""
        return _rows([state.commanded for state in self._taken], len(self._limits))

    @property
    def speeds(self) -> Array:
        """The speeds of the set-points, in these units a second."""
        return _rows([state.speeds for state in self._taken], len(self._limits))

    @property
    def tool(self) -> Array:
        """The positions of the tool centre point, metres: columns x, y, z."""
        return _rows([state.tool.position for state in self._taken], 3)

    @property
    def quaternions(self) -> Array:
        """The orientations of the tool: columns w, x, y, z."""
        return _rows([state.tool.orientation for state in self._taken], 4)

    def plot(self) -> Figure:
        """Draw joints and speeds over time, with their limits as dashed lines.

        Needs matplotlib: pip install 'corbot[plot]'.
        """
        try:
            from matplotlib.figure import Figure
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "A plot needs matplotlib. Install it: pip install matplotlib.", name="matplotlib"
            ) from error
        kinds = [kind for kind in ("turns", "slides") if any(joint.kind == kind for joint in self._limits)]
        figure = Figure(figsize=(8.0, 5.0 * len(kinds)), layout="constrained")
        axes = figure.subplots(2 * len(kinds), 1, sharex=True)
        for row, kind in enumerate(kinds):
            self._plot_joints(axes[2 * row], kind)
            self._plot_speeds(axes[2 * row + 1], kind)
        axes[-1].set_xlabel("time (s)")
        return figure

    def _plot_joints(self, axes: Axes, kind: str) -> None:
        for number, joint in enumerate(self._limits):
            if joint.kind == kind:
                (line,) = axes.plot(self.time, self.joints[:, number], label=joint.name)
                for limit in (joint.soft_lower, joint.soft_upper):
                    if limit is not None:
                        axes.axhline(limit, color=line.get_color(), linestyle="--", linewidth=0.8)
        axes.set_ylabel("joints (°)" if kind == "turns" else "joints (m)")
        axes.legend(loc="upper right")

    def _plot_speeds(self, axes: Axes, kind: str) -> None:
        for number, joint in enumerate(self._limits):
            if joint.kind == kind:
                (line,) = axes.plot(self.time, self.speeds[:, number], label=joint.name)
                for limit in (-joint.speed, joint.speed):
                    axes.axhline(limit, color=line.get_color(), linestyle="--", linewidth=0.8)
        axes.set_ylabel("speeds (°/s)" if kind == "turns" else "speeds (m/s)")

    def _take(self) -> None:
        try:
            for state in self._states:
                self._taken.append(state)
            self._taken.append(self._arm.state)  # the end of the block
        except CorbotError as failure:
            self._failure = failure


def _rows(values: list[tuple[float, ...]], columns: int) -> Array:
    """Give an array with these columns, even without rows."""
    return np.array(values, dtype=np.float64).reshape(-1, columns)
