# SPDX-License-Identifier: Apache-2.0
"""The panel beside nine browsers that watch: a Stop's way to the arm, and the load of ten robots.

Usage: panel_bench.py [TRIALS [SECONDS]]

Runs with the Python of the package's tests. Exit status 1: a bound of docs/figures.md does not hold.
"""

from __future__ import annotations

import contextlib
import http.client
import multiprocessing
import os
import re
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

import corbot
from corbot.simulation import find_program

STOP_P99_S = 0.050
MOST_CORES = 1.0
ROBOTS = 10
BROWSERS = 10
RUN_UP = 90.0  # degrees to the target, for the full speed in the middle
FAR = ([-60.0, 0.0, 0.0, 0.0], [60.0, 0.0, 0.0, 0.0])


@dataclass
class Panel:
    """A running panel, and the token that may drive."""

    pid: int
    port: int
    token: str

    def watch(self) -> socket.socket:
        """Open a WebSocket."""
        browser = socket.create_connection(("127.0.0.1", self.port))
        browser.sendall(
            f"GET /ws?token={self.token} HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\n"
            "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        assert b" 101 " in browser.recv(4096)
        return browser

    def cpu_s(self) -> float:
        """Give the processor time that the panel has used."""
        fields = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _read_all(browsers: list[socket.socket], silent: list[socket.socket], texts: Synchronized[int]) -> None:
    """Read, and send a pong each second, as the panel closes a browser that answers no ping."""
    due = 0.0
    with selectors.DefaultSelector() as ready:
        for browser in browsers:
            ready.register(browser, selectors.EVENT_READ)
        while True:
            for key, _ in ready.select(0.1):
                data = key.fileobj.recv(1 << 16)
                assert data, "the panel closed a browser"
                texts.value += data.count(b"\x81")
            if time.monotonic() > due:
                due = time.monotonic() + 1.0
                for browser in browsers + silent:
                    browser.send(b"\x8a\x80\0\0\0\0")


@contextlib.contextmanager
def reader(browsers: list[socket.socket], silent: list[socket.socket]) -> Iterator[Synchronized[int]]:
    """Read in another process, which does not delay this one; count the texts, which begin with 0x81."""
    texts = multiprocessing.Value("Q", 0)
    process = multiprocessing.Process(target=_read_all, args=(browsers, silent, texts), daemon=True)
    process.start()
    yield texts
    assert process.is_alive(), "a browser has lost its panel"
    process.kill()
    process.join()


@contextlib.contextmanager
def panel(*addresses: str) -> Iterator[Panel]:
    """Run a panel of these robots."""
    with tempfile.TemporaryDirectory() as directory:
        Path(directory, "index.html").write_text("<html/>")
        command = [find_program().parent / "corbot-panel", "--port", "0", "--pages", directory, *addresses]
        environment = {**os.environ, "XDG_RUNTIME_DIR": directory}
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                for line in process.stdout:
                    if found := re.search(r"drive.*:(\d+)/#token=(\w+)", line):
                        yield Panel(process.pid, int(found[1]), found[2])
                        break
            finally:
                process.send_signal(signal.SIGTERM)


def stop_once(arm: corbot.Arm, browser: http.client.HTTPConnection, token: str, target: list[float]) -> float:
    """Stop a motion at its full speed; give the seconds from the request to the first slower set-point."""
    cruise, limit, tries = 0.0, arm.limits[0].speed, 0
    # After an overrun the arm begins again from rest. A Stop then ends the acceleration before it slows down.
    while cruise < 0.999 * limit:
        tries += 1
        assert tries < 20, "the arm never reaches its full speed"
        if abs(arm.state.joints[0] - target[0]) < RUN_UP:
            arm.joints([-joint for joint in target])
        arm.joints(target, wait=False)
        while arm.state.joints[0] * target[0] < 0 or abs(arm.state.joints[0]) < 5:
            time.sleep(0.001)
        cruise = abs(arm.state.speeds[0])
    sent = time.time()
    browser.request("POST", "/api/stop", headers={"Authorization": f"Bearer {token}"})
    while abs((state := arm.state).speeds[0]) > 0.999 * cruise:
        pass
    reply = browser.getresponse()
    assert reply.status == 200, reply.read()
    reply.read()
    return state.time - sent


def stops(trials: int) -> bool:
    """Print the times of Stops beside nine watchers; true if the bound holds."""
    with corbot.simulated("lynx5") as arm, panel(arm.address) as served:
        watchers = [served.watch() for _ in range(BROWSERS - 1)]
        browser = http.client.HTTPConnection("localhost", served.port)
        arm.joints(FAR[0])
        with reader(watchers[1:], watchers[:1]):
            times = sorted(stop_once(arm, browser, served.token, FAR[1 - i % 2]) for i in range(trials))
    p50, p99 = times[len(times) // 2], times[int(0.99 * len(times))]
    print(f"{trials} Stops beside {BROWSERS - 1} watchers, one of which does not read: median "
          f"{1e3 * p50:.1f} ms, p99 {1e3 * p99:.1f} ms, longest {1e3 * times[-1]:.1f} ms")
    return p99 < STOP_P99_S


def load(seconds: float) -> bool:
    """Print the processor time of a panel with ten robots and ten browsers; true if the bound holds."""
    with contextlib.ExitStack() as stack:
        arms = [stack.enter_context(corbot.simulated("lynx5")) for _ in range(ROBOTS)]
        served = stack.enter_context(panel(*(arm.address for arm in arms)))
        texts = stack.enter_context(reader([served.watch() for _ in range(BROWSERS)], []))
        time.sleep(1.0)
        before, begun, seen = served.cpu_s(), time.monotonic(), texts.value
        time.sleep(seconds)
        took = time.monotonic() - begun
        cores, rate = (served.cpu_s() - before) / took, (texts.value - seen) / took / ROBOTS / BROWSERS
    print(f"{ROBOTS} robots to {BROWSERS} browsers: each gets {rate:.1f} states of each robot a second; "
          f"the panel uses {cores:.2f} of a core")
    return cores < MOST_CORES


def main() -> int:
    """Measure."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0
    return 0 if all([stops(trials), load(seconds)]) else 1


if __name__ == "__main__":
    sys.exit(main())
