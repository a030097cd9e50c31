# SPDX-License-Identifier: Apache-2.0
"""Stops of the task against the shortest stops from the same states. stop_ratio.py STOP_STATES [SEED]

STOP_STATES: the program of stop_states.cpp. The shortest stop is a sequence of steps of constant jerk of
lambda along the same path. All steps have the same length, which is made as small as the limits allow. Each
linear program replaces all that is not linear by its tangent at the previous stop. Exit status 1: the bound
of docs/figures.md does not hold.
"""

import json
import subprocess
import sys
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BPoly
from scipy.optimize import linprog
from scipy.sparse import coo_matrix

PATH = 6  # number of the path parameter among a knot's values, after six joints
DIRECTIONS = 8  # of the tool on an arc; one of them is that of the stop before
STEPS = 60
RESERVE = {"all": (1.0, 1.0), "planned": (0.97, 0.95)}  # of acceleration and jerk
SAME = 2e-4  # of the time: the search is over
KEPT = 2e-3  # a limit may be exceeded by so much of it at the end
MOST_PROGRAMS = 40
LEAST_TRUST = 1e-3  # of time, and of the way
BOUND = 1.25  # of the median
FINER = 10  # every tenth stop is sought with twice the steps, too
WORST = 5


class Stop(NamedTuple):
    """A stop in steps of equal time: derivatives by the part of its time, at the nodes; jerk in the steps."""

    time_s: float
    place: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray


class Row(NamedTuple):
    """A quantity at nodes, and its derivatives by a stop's numbers.

    It may reach a limit times a power of the time.
    """

    power: int
    limit: float
    value: np.ndarray
    nodes: np.ndarray  # numbers
    steps: np.ndarray | None  # of the steps, of jerk alone
    by: list[np.ndarray]  # place, speed, acceleration, jerk


class Path:
    """Joints and path parameter over lambda, and their limits."""

    def __init__(self, line: dict[str, Any], acceleration: float, jerk: float) -> None:
        """Take polynomials exactly; the factors leave a reserve."""
        knots = line["knots"]
        self.curves = [BPoly.from_derivatives([k[0] for k in knots], [np.array(k[1:]) for k in knots])]
        for _ in range(4):
            self.curves.append(self.curves[-1].derivative())
        self.end = knots[-1][0]
        none = float("inf")
        full = zip(line["speed"], line["acceleration"], line["jerk"], strict=True)
        limits = [(i, v or none, (a or none) * acceleration, (j or none) * jerk)
                  for i, (v, a, j) in enumerate(full)]
        self.limits = [limit for limit in limits if np.isfinite(limit[1:]).any()]
        self.angle = line["angle_rad"]
        self.arc = (
            (line["arc_acceleration"] * acceleration, line["arc_jerk"] * jerk) if self.angle > 0.0 else None
        )

    def derivatives(self, place: np.ndarray) -> list[np.ndarray]:
        """Give the first four by lambda, a column for each value."""
        inside = np.clip(place, 0.0, self.end)
        return [curve(inside) for curve in self.curves[1:]]

    def rows(self, stop: Stop) -> list[Row]:
        """Give what is limited; both signs are."""
        n = len(stop.jerk)
        nodes, steps = np.arange(n + 1), np.arange(n)
        z = self.derivatives(stop.place)
        rows = []
        for i, v, a, j in self.limits:
            of = Motion(*(d[:, i] for d in z), stop, nodes, None)
            rows += [Row(1, v, *of.first()), Row(2, a, *of.second())]
            rows += [Row(3, j, *Motion(*(d[at, i] for d in z), stop, at, steps).third())
                     for at in (nodes[:-1], nodes[1:])]
        if self.arc is not None:
            rows += self.arc_rows([d[:, PATH] for d in z], stop)
        return [row for row in rows if np.isfinite(row.limit)]

    def arc_rows(self, z: list[np.ndarray], stop: Stop) -> list[Row]:
        """Give the tool's vectors on the arc in some directions."""
        n = len(stop.jerk)
        nodes, steps = np.arange(n + 1), np.arange(n)
        tool = Motion(*z, stop, nodes, None)
        rows = across(2, self.arc[0], nodes, None, tool.second(), tool.towards(self.angle))
        for at in (nodes[:-1], nodes[1:]):
            tool = Motion(*(d[at] for d in z), stop, at, steps)
            rows += across(3, self.arc[1], at, steps, tool.third_along(self.angle),
                           tool.third_across(self.angle))
        return rows


Linear = tuple[np.ndarray, np.ndarray, np.ndarray | None, list[np.ndarray]]


def across(power: int, limit: float, nodes: np.ndarray, steps: np.ndarray | None, along: Linear,
           aside: Linear) -> list[Row]:
    """Give a vector's length by its parts in some directions, the vector's own among them."""
    own = np.arctan2(aside[0], along[0])
    rows = []
    for turn in np.pi * np.arange(DIRECTIONS) / DIRECTIONS:  # the opposite ones are the other sign
        c, s = np.cos(own + turn), np.sin(own + turn)
        by = [c * x + s * y for x, y in zip(along[3], aside[3], strict=True)]
        rows.append(Row(power, limit, c * along[0] + s * aside[0], nodes, steps, by))
    return rows


class Motion:
    """A value's derivatives by time, and their derivatives by place, speed, acceleration and jerk."""

    def __init__(self, z1: Any, z2: Any, z3: Any, z4: Any, stop: Stop, nodes: np.ndarray,
                 steps: np.ndarray | None) -> None:
        """Take derivatives by lambda at the nodes."""
        self.z1, self.z2, self.z3, self.z4 = z1, z2, z3, z4
        self.v, self.a = stop.speed[nodes], stop.acceleration[nodes]
        self.j = np.zeros(len(nodes)) if steps is None else stop.jerk[steps]
        self.at = (nodes, steps)
        self.zero = np.zeros(len(nodes))

    def first(self) -> Linear:
        """Speed."""
        return self.z1 * self.v, *self.at, [self.z2 * self.v, self.z1, self.zero, self.zero]

    def second(self) -> Linear:
        """Acceleration."""
        value = self.z1 * self.a + self.z2 * self.v**2
        by = [self.z2 * self.a + self.z3 * self.v**2, 2.0 * self.z2 * self.v, self.z1, self.zero]
        return value, *self.at, by

    def third(self) -> Linear:
        """Jerk."""
        v, a, j = self.v, self.a, self.j
        value = self.z1 * j + 3.0 * self.z2 * v * a + self.z3 * v**3
        by_place = self.z2 * j + 3.0 * self.z3 * v * a + self.z4 * v**3
        return value, *self.at, [by_place, 3.0 * (self.z2 * a + self.z3 * v**2), 3.0 * self.z2 * v, self.z1]

    def towards(self, angle: float) -> Linear:
        """Acceleration towards the centre of an arc: angle s'^2."""
        first = self.first()
        return angle * first[0] ** 2, *self.at, [2.0 * angle * first[0] * x for x in first[3]]

    def third_along(self, angle: float) -> Linear:
        """Jerk along an arc: s''' - angle^2 s'^3."""
        first, third = self.first(), self.third()
        by = [x - 3.0 * angle**2 * first[0] ** 2 * y for x, y in zip(third[3], first[3], strict=True)]
        return third[0] - angle**2 * first[0] ** 3, *self.at, by

    def third_across(self, angle: float) -> Linear:
        """Jerk across an arc: 3 angle s' s''."""
        first, second = self.first(), self.second()
        by = [3.0 * angle * (first[0] * x + second[0] * y) for x, y in zip(second[3], first[3], strict=True)]
        return 3.0 * angle * first[0] * second[0], *self.at, by


def excess(rows: list[Row], time_s: float) -> float:
    """Give by how much of itself a limit is exceeded."""
    return max(float(np.max(np.abs(row.value))) / (row.limit * time_s**row.power) for row in rows) - 1.0


def program(path: Path, state: list[float], stop: Stop, rows: list[Row], trust: float) -> Stop | None:
    """Give the shortest stop whose limits are those of the tangents at `stop`.

    An excess costs 20 times as much.
    """
    n, t = len(stop.jerk), stop.time_s
    # place, speed, acceleration at n + 1 nodes, jerk in n steps, the time, the excess
    first = [0, n + 1, 2 * (n + 1), 3 * (n + 1)]
    time, slack, count = 4 * n + 3, 4 * n + 4, 4 * n + 5
    data, at, columns, bounds_of = [], [], [], []

    def put(row: np.ndarray, column: np.ndarray | int, value: np.ndarray | float) -> None:
        shape = np.broadcast_shapes(np.shape(row), np.shape(column), np.shape(value))
        for into, what in ((at, row), (columns, column), (data, value)):
            into.append(np.broadcast_to(what, shape).ravel())

    begin = 0
    for row in rows:
        k = np.arange(len(row.value))
        scale = 1.0 / (row.limit * t**row.power)
        moved = [row.nodes, row.nodes, row.nodes, row.steps]
        known = [stop.place, stop.speed, stop.acceleration, stop.jerk]
        rest = row.value.copy()
        for sign in (1.0, -1.0):
            for base, numbers, by in zip(first, moved, row.by, strict=True):
                if numbers is not None:
                    put(begin + k, base + numbers, sign * scale * by)
            put(begin + k, time, np.full(len(k), -row.power / t))
            put(begin + k, slack, np.full(len(k), -1.0))
            begin += len(k)
        for numbers, by, values in zip(moved, row.by, known, strict=True):
            if numbers is not None:
                rest -= by * values[numbers]
        bounds_of += [1.0 - row.power - scale * rest, 1.0 - row.power + scale * rest]
    upper = coo_matrix((np.concatenate(data), (np.concatenate(at), np.concatenate(columns))),
                       shape=(begin, count)).tocsr()
    data.clear(), at.clear(), columns.clear()
    k, h = np.arange(n), 1.0 / n
    terms = [[(0, 1, h), (0, 2, h * h / 2), (0, 3, h**3 / 6)], [(1, 2, h), (1, 3, h * h / 2)], [(2, 3, h)]]
    for i, term in enumerate(terms):
        put(i * n + k, first[i] + k + 1, 1.0)
        put(i * n + k, first[i] + k, -1.0)
        for _, of, factor in term:
            put(i * n + k, first[of] + k, -factor)
    # It begins in the state, by the time's tangent, and ends at rest.
    ends = [(first[0], 0.0, state[0]), (first[1], -state[1], 0.0),
            (first[2], -2.0 * state[2] * t, -state[2] * t * t)]
    ends += [(first[1] + n, 0.0, 0.0), (first[2] + n, 0.0, 0.0)]
    for i, (column, by_time, _) in enumerate(ends):
        put(3 * n + i, column, 1.0)
        put(3 * n + i, time, by_time)
    equal = coo_matrix((np.concatenate(data), (np.concatenate(at), np.concatenate(columns))),
                       shape=(3 * n + 5, count)).tocsr()
    right = np.concatenate([np.zeros(3 * n), [end[2] for end in ends]])
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    reach = trust * max(state[1] * t, 1e-9)
    low[: n + 1], high[: n + 1] = stop.place - reach, np.minimum(stop.place + reach, path.end)
    low[first[1] : first[2]] = 0.0
    low[time], high[time] = t * (1.0 - trust), t * (1.0 + trust)
    low[slack] = 0.0
    cost = np.zeros(count)
    cost[time], cost[slack] = 1.0 / t, 20.0
    found = linprog(cost, upper, np.concatenate(bounds_of), equal, right, np.stack([low, high], 1),
                    method="highs")
    if found.x is None:
        return None
    x = found.x
    return run(state, float(x[time]), x[first[3] : time])


def run(state: list[float], time_s: float, jerk: np.ndarray) -> Stop:
    """Give the stop that these jerks make from the state."""
    h = 1.0 / len(jerk)
    place, speed, acceleration = [state[0]], [state[1] * time_s], [state[2] * time_s**2]
    for j in jerk:
        p, v, a = place[-1], speed[-1], acceleration[-1]
        place.append(p + h * (v + h * (a / 2 + h * j / 6)))
        speed.append(v + h * (a + h * j / 2))
        acceleration.append(a + h * j)
    return Stop(time_s, np.array(place), np.array(speed), np.array(acceleration), jerk)


def begun(line: dict[str, Any], steps: int) -> Stop:
    """Give the task's own stop, in steps."""
    time_s = line["stop_s"]
    way = np.array(line["way"])
    at = np.linspace(0.0, 1.0, len(way))
    nodes = np.linspace(0.0, 1.0, steps + 1)
    place = np.interp(nodes, at, way[:, 0])
    speed = np.interp(nodes, at, way[:, 1]) * time_s
    acceleration = np.gradient(speed, nodes)
    return Stop(time_s, place, speed, acceleration, np.diff(acceleration) * steps)


def shortest(line: dict[str, Any], path: Path, steps: int) -> tuple[float, float]:
    """Give the time of the shortest stop, and by how much of itself it exceeds a limit or misses rest."""
    state = line["state"]
    stop, trust = begun(line, steps), 0.5
    rows, best = path.rows(stop), (float("inf"), float("inf"))
    for _ in range(MOST_PROGRAMS):
        then = program(path, state, stop, rows, trust)
        if then is None:
            trust /= 4.0
            continue
        rows_then = path.rows(then)
        missed = (abs(then.speed[-1]) / (state[1] * then.time_s)
                  + abs(then.acceleration[-1]) / (state[1] * then.time_s))
        off = max(0.0, excess(rows_then, then.time_s), missed)
        merit = then.time_s * (1.0 + 5.0 * off)
        is_better = merit < best[0] * (1.0 - SAME)
        if merit < best[0]:
            best, stop, rows = (merit, off), then, rows_then
        if not is_better:
            trust /= 4.0
            if trust < LEAST_TRUST:
                break
    return stop.time_s, best[1]


class Compared(NamedTuple):
    """One stop."""

    name: str
    kind: str
    stop_s: float
    ends: bool
    shortest_s: dict[str, float]  # nan where none was found
    at_once_s: float  # the task's stop if its search took no time
    finer: float  # the shortest with twice the steps, by that


def compare(line: dict[str, Any], number: int) -> Compared:
    """Seek the shortest stops."""
    sought = {name: shortest(line, Path(line, *reserve), STEPS) for name, reserve in RESERVE.items()}
    times = {name: time_s if off <= KEPT else float("nan") for name, (time_s, off) in sought.items()}
    finer = float("nan")
    if number % FINER == 0:
        finer = shortest(line, Path(line, 1.0, 1.0), 2 * STEPS)[0] / times["all"]
    kind = f"{line['arm']} {line['kind']}"
    return Compared(f"{kind} {number}", kind, line["stop_s"], line["ends"], times, line["at_once_s"], finer)


def quantiles(ratios: list[float]) -> str:
    """Give median, p95 and the greatest."""
    return "  ".join(f"{x:7.4f}" for x in np.quantile(ratios, [0.5, 0.95, 1.0]))


def main() -> int:
    """Measure."""
    output = subprocess.run(sys.argv[1:], check=True, stdout=subprocess.PIPE, text=True).stdout
    stops = [compare(json.loads(line), number) for number, line in enumerate(output.splitlines())]
    for name, reserve in RESERVE.items():
        known = [stop for stop in stops if np.isfinite(stop.shortest_s[name])]
        print(f"stops over the shortest with {reserve[0]:.0%} of acceleration, {reserve[1]:.0%} of jerk: "
              "median, p95, worst")
        groups = {kind: [stop for stop in known if stop.kind == kind]
                  for kind in dict.fromkeys(stop.kind for stop in known)}
        groups |= {"rest before the end": [stop for stop in known if not stop.ends]}
        groups |= {"end the path": [stop for stop in known if stop.ends], "all": known}
        for title, group in groups.items():
            if group:
                print(f"  {title:20} {quantiles([stop.stop_s / stop.shortest_s[name] for stop in group])}"
                      f"  of {len(group)}")
        print(f"  {len(stops) - len(known)} left out, whose shortest stop was not found")
    known = [stop for stop in stops if np.isfinite(stop.shortest_s["all"])]
    for stop in sorted(known, key=lambda s: -s.stop_s / s.shortest_s["all"])[:WORST]:
        least_s = stop.shortest_s["all"]
        print(f"  {stop.stop_s / least_s:.3f}  {stop.name}: {stop.stop_s:.3f} s, shortest {least_s:.3f} s")
    at_once = [stop.at_once_s / stop.shortest_s["all"] for stop in known]
    print(f"if the search took no time: {quantiles(at_once)}")
    finer = [stop.finer for stop in stops if np.isfinite(stop.finer)]
    print(f"the shortest with twice the steps, {len(finer)} times: "
          f"{min(finer):.4f} to {max(finer):.4f} of it")
    median = float(np.median([stop.stop_s / stop.shortest_s["all"] for stop in known]))
    print(f"{'ok  ' if median <= BOUND else 'MISS'}  median: {median:.4f}, wanted <= {BOUND:g}")
    return 0 if median <= BOUND else 1


if __name__ == "__main__":
    sys.exit(main())
