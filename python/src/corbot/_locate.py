# SPDX-License-Identifier: Apache-2.0
"""Finds robots: `corbot up` writes the file NAME.json, and holds the lock of NAME.lock while it lives."""

from __future__ import annotations

import fcntl
import json
import os
import re
from pathlib import Path
from typing import Any

from corbot.errors import BadAddress, RobotNotFound

_NAME = re.compile(r"[A-Za-z0-9_-]{1,32}")
_HOST_PORT_NAME = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[^\s/:]+):\d+/\S+")
_ADDRESS = ("corbaloc:", "corbaname:", "IOR:")


def run_directory() -> Path:
    """Give the directory with the files of this user's robots."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    return Path(base) / "corbot" if base else Path(f"/tmp/corbot-{os.getuid()}")


def is_up(name: str, directory: Path) -> bool:
    """Check whether a supervisor of that robot lives. A file left behind does not count."""
    try:
        with open(directory / f"{name}.lock", "rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def robots_up(directory: Path) -> list[str]:
    """Give the names of the robots that are up, sorted."""
    return sorted(file.stem for file in directory.glob("*.json") if is_up(file.stem, directory))


def read_robot(name: str, directory: Path) -> dict[str, Any]:
    """Read the file of a robot; empty if there is none."""
    try:
        data = json.loads((directory / f"{name}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}


def address_of(robot: str | None) -> str:
    """Give the CORBA address of a robot by its name or address; None: the only robot that is up here."""
    if robot is None:  # an empty text does not mean any robot
        robot = os.environ.get("CORBOT_ROBOT") or _only_robot()
    if not isinstance(robot, str):
        raise TypeError(f"A robot is named by a text, not by {robot!r}.")
    if robot.startswith(_ADDRESS):
        return robot
    if _HOST_PORT_NAME.fullmatch(robot):
        return f"corbaloc::{robot}"
    if not _NAME.fullmatch(robot):
        raise BadAddress(robot)
    directory = run_directory()
    address = read_robot(robot, directory).get("address") if is_up(robot, directory) else None
    if not address:
        raise RobotNotFound(robot, _what_is_up(directory))
    return str(address)


def _only_robot() -> str:
    directory = run_directory()
    names = robots_up(directory)
    if len(names) != 1:
        raise RobotNotFound("", _what_is_up(directory), several=bool(names))
    return names[0]


def _what_is_up(directory: Path) -> str:
    names = ", ".join(robots_up(directory)) or "none"
    return f"looked in {directory}, where these are up: {names}"
