# SPDX-License-Identifier: Apache-2.0
"""Times of random lines and arcs against toppra's on the same knots and limits.

Usage: toppra_bench.py PATH_TIMES [SEED]

PATH_TIMES: the program of path_times.cpp. Exit status 1: a bound of docs/figures.md does not hold.
"""

import json
import logging
import subprocess
import sys
import time
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BPoly
from toppra import constraint
from toppra.algorithm import TOPPRA
from toppra.interpolator import AbstractGeometricPath

PATH = 6  # number of the path parameter among a knot's values, after six joints
DIRECTIONS = 12  # of the tool on an arc, each two-sided: a polygon of 24 sides around the circle
UNIFORM = 800  # grid points, beside eight in each cell and ten finer ones at each end
MOST_TIME_PAST_AXIS_S = 2.0
WORST = 5


class Rows(AbstractGeometricPath):
    """The limits of toppra along a path.

    The joints have limits, with the tool also the path parameter, and on an arc the tool's directions.
    """

    def __init__(self, plan: dict[str, Any], joints: int, with_tool: bool) -> None:
        """Take the polynomials between the knots exactly."""
        self.lambdas = np.array([knot[0] for knot in plan["knots"]])
        values = [np.array(knot[1:]) for knot in plan["knots"]]
        curve = BPoly.from_derivatives(self.lambdas, values)
        self.curves = [curve, curve.derivative(1), curve.derivative(2)]
        self.columns = [*range(joints), PATH] if with_tool else list(range(joints))
        self.angle = plan["angle_rad"] if with_tool else 0.0
        speed = [plan["speed"][i] for i in self.columns]
        acceleration = [plan["acceleration"][i] for i in self.columns]
        if self.angle > 0.0:
            if acceleration[-1] is None:  # the tool does not turn
                acceleration[-1] = plan["arc_acceleration"]
            speed += [speed[-1]] * DIRECTIONS
            acceleration += [plan["arc_acceleration"]] * DIRECTIONS
        self.speed, self.acceleration = np.array(speed), np.array(acceleration)

    def __call__(self, path_positions: np.ndarray, order: int = 0) -> np.ndarray:
        """Give values, or derivatives by lambda."""
        z = self.curves[order](path_positions)
        rows = z[..., self.columns]
        if self.angle == 0.0:
            return rows
        directions = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        along, across = np.cos(directions), np.sin(directions)
        tool = z[..., PATH, None] * along
        if order == 2:
            tool = tool + self.angle * self.curves[1](path_positions)[..., PATH, None] ** 2 * across
        return np.concatenate([rows, tool], axis=-1)

    @property
    def dof(self) -> int:
        """Give the number of rows."""
        return len(self.speed)

    @property
    def path_interval(self) -> np.ndarray:
        """Give the first and the last lambda."""
        return self.lambdas[[0, -1]]

    def constraints(self) -> list[constraint.Constraint]:
        """Give toppra's constraints, also kept at the end of each step."""
        return [
            constraint.JointVelocityConstraint(np.stack([-self.speed, self.speed], 1)),
            constraint.JointAccelerationConstraint(np.stack([-self.acceleration, self.acceleration], 1)),
        ]

    def fine_grid(self, refine: int = 1) -> np.ndarray:
        """Give grid points that leave little of toppra's own error."""
        length = self.lambdas[-1]
        even = np.linspace(0.0, length, UNIFORM * refine + 1)
        ends = np.linspace(0.0, even[1], 11)
        cells = np.concatenate([np.linspace(a, b, 8 * refine + 1)
                                for a, b in zip(self.lambdas, self.lambdas[1:], strict=False)])
        grid = np.unique(np.concatenate([even, ends, length - ends, cells]))
        return grid[np.concatenate([[True], np.diff(grid) > 1e-9 * length])]


def optimum_s(rows: Rows, refine: int = 1) -> float:
    """Give toppra's time on the fine grid; nan where it finds none."""
    grid = rows.fine_grid(refine)
    _, rates, _ = TOPPRA(
        rows.constraints(), rows, gridpoints=grid, solver_wrapper="seidel"
    ).compute_parameterization(0, 0)
    if rates is None:
        return float("nan")
    return float(np.sum(2.0 * np.diff(grid) / (rates[1:] + rates[:-1])))


def plan_us(rows: Rows) -> float:
    """Give the processor time that toppra takes on its own grid."""
    begun = time.thread_time()
    TOPPRA(rows.constraints(), rows, solver_wrapper="seidel").compute_parameterization(0, 0)
    return 1e6 * (time.thread_time() - begun)


class Compared(NamedTuple):
    """One path."""

    name: str
    kind: str
    lifted: float  # our time over toppra's, speed and acceleration of the joints alone; nan if one has none
    everything: float  # our time with all limits over toppra's with the tool and one ramp
    own_us: float
    peer_us: float
    lifted_cause: str
    everything_cause: str


def cause(plan: dict[str, Any]) -> str:
    """Say what bounds a path, the longest first."""
    times: dict[str, float] = {}
    for part in plan["reasons"]:
        limit = part["limit"] if part["share"] > 0.9 else "below 0.9 of all limits"
        times[limit] = times.get(limit, 0.0) + part["time_s"]
    longest = sorted(times.items(), key=lambda item: -item[1])[:4]
    shares = ", ".join(f"{limit} {100 * spent / plan['time_s']:.0f} %" for limit, spent in longest)
    return (f"{plan['time_s']:.3f} s, {len(plan['knots'])} knots, "
            f"least pivot {plan.get('pivot', float('nan')):.2g}: {shares}")


def compare(line: dict[str, Any], number: int) -> Compared:
    """Run toppra on one path."""
    own, lifted, joints = line["all"], line["lifted"], line["joints"]
    ratio = (float("nan") if lifted is None
             else lifted["time_s"] / optimum_s(Rows(lifted, joints, with_tool=False)))
    everything = own["time_s"] / (optimum_s(Rows(own, joints, with_tool=True)) + line["ramp_s"])
    peer_us = plan_us(Rows(own, joints, with_tool=False))
    kind, causes = f"{line['arm']} {line['kind']}", ["refused" if plan is None else cause(plan)
                                                     for plan in (lifted, own)]
    return Compared(f"{kind} {number}", kind, ratio, everything, line["plan_us"], peer_us, *causes)


def quantiles(ratios: list[float]) -> str:
    """Give median, p95, p99 and the greatest."""
    return "  ".join(f"{x:7.4f}" for x in np.quantile(ratios, [0.5, 0.95, 0.99, 1.0]))


def check(what: str, value: float, bound: float) -> bool:
    """Print and return whether a bound holds."""
    holds = value <= bound
    print(f"{'ok  ' if holds else 'MISS'}  {what}: {value:.4f}, wanted <= {bound:g}")
    return holds


def report(title: str, field: str, paths: list[Compared]) -> list[float]:
    """Print one comparison, and return its ratios."""
    known = [path for path in paths if np.isfinite(getattr(path, field))]
    print(f"{title}: {len(known)} paths, {len(paths) - len(known)} without both times")
    print(f"  {'':16}  median      p95      p99    worst")
    for kind in dict.fromkeys(path.kind for path in known):
        print(f"  {kind:16} {quantiles([getattr(path, field) for path in known if path.kind == kind])}")
    ratios = [getattr(path, field) for path in known]
    print(f"  {'all':16} {quantiles(ratios)}")
    for path in sorted(known, key=lambda path: -getattr(path, field))[:WORST]:
        print(f"  {getattr(path, field):.4f}  {path.name}: {getattr(path, field + '_cause')}")
    return ratios


def main() -> int:
    """Measure."""
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    output = subprocess.run(sys.argv[1:], check=True, stdout=subprocess.PIPE, text=True).stdout
    past_axis, *lines = (json.loads(line) for line in output.splitlines())
    paths = [compare(line, number) for number, line in enumerate(lines)]
    lifted = report("speed and acceleration of the joints, over toppra's optimum", "lifted", paths)
    everything = report("all limits, over toppra's optimum with the tool and one ramp a/j", "everything",
                        paths)
    own, peer = (np.quantile([getattr(path, name) for path in paths], [0.5, 0.99])
                 for name in ("own_us", "peer_us"))
    print("processor time to plan, median and p99")
    print(f"  corbot {own[0]:6.0f} us {own[1]:6.0f} us: geometry, all limits, proof")
    print(f"  toppra {peer[0]:6.0f} us {peer[1]:6.0f} us: given the geometry, joints alone, on its own grid")
    kept = [
        check("speed and acceleration, median", float(np.quantile(lifted, 0.5)), 1.02),
        check("speed and acceleration, p99", float(np.quantile(lifted, 0.99)), 1.10),
        check("all limits, median", float(np.quantile(everything, 0.5)), 1.08),
        check("all limits, p95", float(np.quantile(everything, 0.95)), 1.20),
        check("the line that passes the axis at 3 mm, in s", past_axis["all"]["time_s"],
              MOST_TIME_PAST_AXIS_S),
    ]
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())
