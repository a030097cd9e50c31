# SPDX-License-Identifier: Apache-2.0
"""The Python package against bare omniORBpy: reads, a zero-length move, a minute of states.

Usage: package_bench.py [SECONDS]

Exit status 1: a bound of docs/figures.md does not hold.
"""

import statistics
import sys
import time
from collections.abc import Callable

import corbot

AT_REST = [0.0, 0.0, 0.0, 0.0]
MOST_RATIO = 1.5
MOST_DROPPED = 0.01


def median_us(call: Callable[[], object], count: int) -> float:
    """Give the median time of a call, microseconds."""
    times = []
    for _ in range(count):
        begun = time.perf_counter()
        call()
        times.append(time.perf_counter() - begun)
    return 1e6 * statistics.median(times)


def compare(name: str, bare: Callable[[], object], package: Callable[[], object], count: int) -> bool:
    """Print both medians; true if the package keeps the bound. The two take turns, as load comes and goes."""
    rounds = [(median_us(bare, count), median_us(package, count)) for _ in range(5)]
    ratio = statistics.median(package / bare for bare, package in rounds)
    bare_us, package_us = (statistics.median(column) for column in zip(*rounds, strict=True))
    print(f"{name}: omniORBpy {bare_us:.1f} us, corbot {package_us:.1f} us, {ratio:.2f} times")
    return ratio <= MOST_RATIO


def share_dropped(arm: corbot.Arm, seconds: float) -> float:
    """Read 250 states a second for so long."""
    states, end, given = arm.states(250), time.monotonic() + seconds, 0
    while time.monotonic() < end:
        next(states)
        given += 1
    share = states.dropped / (given + states.dropped)
    print(f"states(250) for {seconds:g} s: {given} given, {states.dropped} dropped, {100 * share:.2f} %")
    return share


def main() -> int:
    """Measure."""
    with corbot.simulated("lynx5") as arm:
        bare = arm._reference
        kept = [
            compare("joints", bare._get_ArtiCoord, lambda: arm.call("_get_ArtiCoord"), 1000),
            compare("state", bare._get_State, lambda: arm.state, 1000),
            compare("zero-length move", lambda: bare.MoveJoints(AT_REST, 0.0),
                    lambda: arm.joints(AT_REST), 100),
            share_dropped(arm, float(sys.argv[1]) if len(sys.argv) > 1 else 60.0) <= MOST_DROPPED,
        ]
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())
