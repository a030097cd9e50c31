# SPDX-License-Identifier: Apache-2.0
"""Private simulated robots and cells, for tests, notebooks and first steps."""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, TypeVar

from corbot import _locate
from corbot.arm import Arm, connect
from corbot.cell import Cell, cell
from corbot.errors import CellNotFound, SimulationFailed

_UP_WITHIN = 60.0  # seconds
_DOWN_WITHIN = 60.0  # it gives each of its own programs some seconds
_CELL_PORTS = 8  # store, camera, coordinator, and up to five robots
_Found = TypeVar("_Found")


def simulated(
    profile: str | os.PathLike[str] = "lynx5", *, orb: Literal["omniorb", "orbit2"] = "omniorb"
) -> Simulation:
    """Give a simulated robot.

    `with corbot.simulated("lynx5") as arm:` starts it, and ends it at the end of the block.

    `profile` is a path, or the name of a profile in $CORBOT_PROFILES, else of one shipped with the program.
    The program `corbot` is that of $CORBOT_BIN (a file or its directory), of PATH, or of build/*/bin in this
    directory or above it. `orb` names the servant's ORB.
    """
    return Simulation(profile, orb)


def simulated_cell(
    file: str | os.PathLike[str] = "cell/cell", *, pieces: int = 4, seed: int = 1
) -> CellSimulation:
    """Give a simulated cell that works.

    `with corbot.simulated_cell() as cell:` runs it until the block or the work ends.

    `file` is the path of a cell.toml, or the name of a cell that is shipped with the program.
    """
    return CellSimulation(file, pieces, seed)


class _Program:
    """A run of the program `corbot`, with a private directory and its own name."""

    def __init__(self, profile: str | os.PathLike[str]) -> None:
        self.program = find_program()
        self.profile = find_profile(os.fspath(profile), self.program)
        kind = re.sub(r"[^A-Za-z0-9_-]", "_", self.profile.stem)[:23]  # a name has at most 32 characters
        self.name = f"{kind}-{secrets.token_hex(4)}"  # unique on the machine, wherever the robots' files are
        self._directory: Path | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._held: int | None = None
        self._owner = os.getpid()

    def end(self) -> None:
        """End the run and remove its directory; no effect if it is down, or in a fork of this process."""
        atexit.unregister(self.end)
        if os.getpid() != self._owner:
            return
        process, self._process = self._process, None
        if process is not None:
            if process.poll() is None:
                _terminate(process)
            assert process.stdin is not None
            process.stdin.close()
        if self._held is not None:
            os.close(self._held)
            self._held = None
        if self._directory is not None:
            shutil.rmtree(self._directory, ignore_errors=True)

    @property
    def directory(self) -> Path:
        """The private directory of the newest run."""
        if self._directory is None:
            raise SimulationFailed(f"{self.name} was never started, so it has no directory.")
        return self._directory

    @property
    def output(self) -> str:
        """The output of its programs."""
        try:
            return (self.directory / "output").read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            raise SimulationFailed(f"{self.name} has ended, and its output with it.") from None

    def wait(self, timeout: float) -> int:
        """Wait until it ends by itself, at most `timeout` seconds, and give its exit code."""
        if self._process is None:
            raise SimulationFailed(f"{self.name} is not up, so nothing will end. Call start() first.")
        return self._process.wait(timeout)

    def _begin(self, command: Callable[[Path], list[str]], find: Callable[[], _Found | None]) -> _Found:
        """Start `corbot` with that command in a new directory; give the result of `find` once it is up."""
        if self._process is not None:
            found = find() if self._process.poll() is None else None
            if found is not None:
                return found
            self.end()
        self._directory = Path(tempfile.mkdtemp(prefix="corbot-")).absolute()  # $TMPDIR may be relative
        atexit.register(self.end)
        try:
            words = command(self.directory)
            self._process = self._start(words)
            told = " ".join(words[: words.index(str(self.profile)) + 1])
            return self._await(self._process, f"'corbot {told}'", find)
        except BaseException:
            self.end()
            raise

    def _start(self, command: list[str]) -> subprocess.Popen[bytes]:
        environment = {k: v for k, v in os.environ.items() if k not in ("CORBOT_RUN_DIR", "CORBOT_STATE_DIR")}
        environment["XDG_RUNTIME_DIR"] = str(self.directory)
        held = self._start_sweeper()
        with open(self.directory / "output", "wb") as output:
            return subprocess.Popen(
                [str(self.program), *command, "--until-eof"],
                env=environment,
                stdin=subprocess.PIPE,  # its end, however Python ends, ends the program
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is for the client, which needs the servant for its Stop
                pass_fds=[held],
            )

    def _start_sweeper(self) -> int:
        """Start a process that removes the directory when Python and all programs have ended.

        They hold the pipe that it reads. A program that outlives `corbot` may still write there after `end`.
        """
        read, self._held = os.pipe()
        sweep = 'exec 3<&0; (read -r _ <&3; /bin/rm -rf -- "$0") &'  # `&` takes standard input away
        subprocess.run(
            ["/bin/sh", "-c", sweep, self.directory], stdin=read, start_new_session=True, check=True
        )
        os.close(read)
        return self._held

    def _await(
        self, process: subprocess.Popen[bytes], what: str, find: Callable[[], _Found | None]
    ) -> _Found:
        end = time.monotonic() + _UP_WITHIN
        while time.monotonic() < end:
            found = find()
            if found is not None:
                return found
            if process.poll() is not None:
                raise SimulationFailed(f"{what} ended.", self.output)
            time.sleep(0.01)
        raise SimulationFailed(f"{what} was not up within {_UP_WITHIN:g} s.", self.output)


class Simulation(_Program):
    """The processes of a simulated robot, which has a free port and a private directory."""

    def __init__(self, profile: str | os.PathLike[str] = "lynx5", orb: str = "omniorb") -> None:
        super().__init__(profile)
        self._orb = orb

    def start(self) -> Arm:
        """Start the robot if it is not up, and connect to its arm; `end`, or the end of Python, ends it."""
        return connect(self._begin(self._command, lambda: self.processes.get("address") or None))

    def __enter__(self) -> Arm:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.end()

    @property
    def processes(self) -> dict[str, Any]:
        """The data of `corbot up` on the robot: `servant_pid`, `rt_pid`, `address` and more."""
        return _locate.read_robot(self.name, self.directory / "corbot")

    def _command(self, directory: Path) -> list[str]:
        options = [
            "--name",
            self.name,
            "--endpoint",
            f"127.0.0.1:{_free_ports(1)}",
            "--realtime",
            "best-effort",
            "--simulated",
        ]
        options += ["--orb", self._orb]
        return ["up", str(self.profile), *options, "--state-dir", str(directory)]


class CellSimulation(_Program):
    """The processes of a simulated cell, which has free ports and a private directory."""

    def __init__(self, file: str | os.PathLike[str], pieces: int, seed: int) -> None:
        super().__init__(file)
        self._pieces, self._seed = pieces, seed

    def start(self) -> Cell:
        """Start the cell and its work if it is not up; `end`, or the end of Python, ends it."""
        return self._begin(self._command, self._find)

    def __enter__(self) -> Cell:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.end()

    def _find(self) -> Cell | None:
        try:
            found = cell(self.directory / "cell")
        except CellNotFound:
            return None
        return found if found.is_running else None  # the start of the work ends a pause

    def _command(self, directory: Path) -> list[str]:
        options = [
            "--name",
            self.name,
            "--ports",
            str(_free_ports(_CELL_PORTS)),
            "--state-dir",
            str(directory / "cell"),
        ]
        return [
            "cell",
            "run",
            str(self.profile),
            *options,
            "--pieces",
            str(self._pieces),
            "--seed",
            str(self._seed),
        ]


def _terminate(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(_DOWN_WITHIN)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def find_program() -> Path:
    """Give the program `corbot`: $CORBOT_BIN, PATH, or the newest build/*/bin here or above."""
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
    built.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    if not built:
        raise SimulationFailed(
            "No program corbot is in $CORBOT_BIN (which is not set), in PATH, "
            f"or in build/*/bin of {here} and above. "
            "Install corbot, or set CORBOT_BIN to its directory."
        )
    return built[0]


def find_profile(profile: str, program: Path) -> Path:
    """Give the file of a profile: a path, or a name in $CORBOT_PROFILES, else a shipped profile."""
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
    there = (
        f"These are: {', '.join(names)}."
        if names
        else "No profile is there: set $CORBOT_PROFILES to the directory of yours."
    )
    raise SimulationFailed(f"'{profile}' is no profile of $CORBOT_PROFILES or of {program}. {there}")


def _free_ports(count: int) -> int:
    """Give the first of this number of consecutive free ports."""
    while True:
        # The profiles' robots and cells, and the tests in C++, have ports from 10000 on.
        first = secrets.randbelow(8000 - count) + 2000
        with contextlib.ExitStack() as probes, contextlib.suppress(OSError):
            for port in range(first, first + count):
                probes.enter_context(socket.socket()).bind(("127.0.0.1", port))
            return first
