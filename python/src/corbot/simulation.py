# SPDX-License-Identifier: Apache-2.0
"""A simulated robot of one's own, for tests, notebooks and first steps."""

from __future__ import annotations

import atexit
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any

from corbot import _locate
from corbot.arm import Arm, connect
from corbot.errors import SimulationFailed

_UP_WITHIN = 30.0  # seconds
_DOWN_WITHIN = 15.0


def simulated(profile: str = "lynx5") -> Simulation:
    """Give a simulated robot: `with corbot.simulated("lynx5") as arm:` starts it, and takes it down at the end of the block.

    `profile` is a path, or the name of a profile in $CORBOT_PROFILES, else of one shipped with the program. The program
    `corbot` is that of $CORBOT_BIN (a file or its directory), of PATH, or of build/*/bin in this directory or above it.
    """
    return Simulation(profile)


class Simulation:
    """The processes of a simulated robot, which has a free port and a private directory."""

    def __init__(self, profile: str = "lynx5") -> None:
        self.program = find_program()
        self.profile = find_profile(profile, self.program)
        kind = re.sub(r"[^A-Za-z0-9_-]", "_", self.profile.stem)[:23]  # a name has at most 32 characters
        self.name = f"{kind}-{secrets.token_hex(4)}"  # each name is on a machine once, wherever the robots' files are
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> Arm:
        """Start the robot and connect to its arm, for a notebook; `end`, or the end of Python, takes it down."""
        self.directory = Path(tempfile.mkdtemp(prefix="corbot-"))
        atexit.register(self.end)
        try:
            self._process = self._start()
            return connect(self._await_address(self._process))
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        """Take the robot down and remove its directory; no effect on one that is down."""
        atexit.unregister(self.end)
        process, self._process = self._process, None
        if process is not None and process.poll() is None:
            _terminate(process)
        shutil.rmtree(self.directory, ignore_errors=True)

    def __enter__(self) -> Arm:
        return self.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.end()

    @property
    def output(self) -> str:
        """What the robot's programs have written."""
        return (self.directory / "output").read_text(encoding="utf-8", errors="replace")

    @property
    def processes(self) -> dict[str, Any]:
        """What `corbot up` has written of the robot: `servant_pid`, `rt_pid`, `address` and more."""
        return _locate.read_robot(self.name, self.directory / "corbot")

    def _start(self) -> subprocess.Popen[bytes]:
        options = ["--name", self.name, "--endpoint", f"127.0.0.1:{_free_port()}", "--realtime", "best-effort"]
        options += ["--state-dir", str(self.directory)]
        environment = {k: v for k, v in os.environ.items() if k not in ("CORBOT_RUN_DIR", "CORBOT_STATE_DIR")}
        environment["XDG_RUNTIME_DIR"] = str(self.directory)
        with open(self.directory / "output", "wb") as output:
            return subprocess.Popen(
                [str(self.program), "up", str(self.profile), *options],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is for the client, which needs the servant for its Stop
            )

    def _await_address(self, process: subprocess.Popen[bytes]) -> str:
        end = time.monotonic() + _UP_WITHIN
        while time.monotonic() < end:
            if address := self.processes.get("address"):
                return str(address)
            if process.poll() is not None:
                raise SimulationFailed(f"'corbot up {self.profile}' ended.", self.output)
            time.sleep(0.01)
        raise SimulationFailed(f"'corbot up {self.profile}' was not up within {_UP_WITHIN:g} s.", self.output)


def _terminate(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(_DOWN_WITHIN)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def find_program() -> Path:
    """Give the program `corbot`: $CORBOT_BIN, PATH, or build/*/bin in this directory or above it."""
    given = os.environ.get("CORBOT_BIN")
    if given:
        path = Path(given) / "corbot" if Path(given).is_dir() else Path(given)
        if not path.is_file():
            raise SimulationFailed(f"$CORBOT_BIN is '{given}', where there is no program corbot.")
        return path.resolve()
    if found := shutil.which("corbot"):
        return Path(found).resolve()
    here = Path.cwd()
    built = [path for top in (here, *here.parents) for path in top.glob("build/*/bin/corbot")]
    if not built:
        raise SimulationFailed(
            f"No program corbot is in $CORBOT_BIN (which is not set), in PATH, or in build/*/bin of {here} and above. "
            "Install corbot, or set CORBOT_BIN to its directory."
        )
    return built[0]


def find_profile(profile: str, program: Path) -> Path:
    """Give the file of a profile: a path, or the name of one in $CORBOT_PROFILES, else of those shipped with the program."""
    if profile.endswith(".toml"):
        if not Path(profile).is_file():
            raise SimulationFailed(f"There is no profile {profile}.")
        return Path(profile).resolve()
    given = os.environ.get("CORBOT_PROFILES")
    shipped = [program.parents[1] / "share/corbot/profiles", *(top / "profiles" for top in program.parents)]
    if given:
        shipped = [Path(given)]
    for directory in shipped:
        if (directory / f"{profile}.toml").is_file():
            return directory / f"{profile}.toml"
    names = sorted(file.stem for directory in shipped for file in directory.glob("*.toml"))
    raise SimulationFailed(f"'{profile}' is no profile of $CORBOT_PROFILES or of {program}. These are: {', '.join(names)}.")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
