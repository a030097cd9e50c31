# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import contextlib
import fcntl
import json
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

import corbot
from conftest import Robot
from support import simulated_with_naming, until


@pytest.fixture
def here(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Robot:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(robot.simulation.directory))
    monkeypatch.delenv("CORBOT_ROBOT", raising=False)
    return robot


def test_by_its_name(here: Robot) -> None:
    assert corbot.connect(here.simulation.name).address == here.arm.address


def test_by_host_port_and_name(here: Robot) -> None:
    short = here.arm.address.removeprefix("corbaloc::")
    assert corbot.connect(short).address == here.arm.address


def test_by_the_environment(here: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CORBOT_ROBOT", here.arm.address)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/nonexistent")
    assert corbot.connect().address == here.arm.address


def test_the_only_one_that_is_up(here: Robot) -> None:
    assert corbot.connect().address == here.arm.address


def test_a_missing_robot_says_where_it_was_looked_for(here: Robot) -> None:
    with pytest.raises(corbot.RobotNotFound, match="these are up: lynx5-.*corbot up PROFILE") as raised:
        corbot.connect("puma560")
    assert raised.value.looked_for == "puma560"
    assert f"{here.simulation.directory}/corbot" in raised.value.where


def test_several_that_are_up_need_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CORBOT_ROBOT", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "corbot").mkdir()
    with contextlib.ExitStack() as locks:
        for name in ("left", "right"):
            (tmp_path / f"corbot/{name}.json").write_text("{}")
            lock = locks.enter_context(open(tmp_path / f"corbot/{name}.lock", "wb"))
            fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(
            corbot.RobotNotFound, match=r"are up: left, right\. Give the name of one"
        ) as raised:
            corbot.connect()
    assert "Start one" not in str(raised.value)


def test_no_robot_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CORBOT_ROBOT", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(corbot.RobotNotFound, match="these are up: none"):
        corbot.connect()


def test_a_file_that_a_dead_robot_has_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    directory = tmp_path / "corbot"
    directory.mkdir()
    (directory / "dead.json").write_text(json.dumps({"address": "corbaloc::127.0.0.1:1/dead"}))
    (directory / "dead.lock").touch()
    with pytest.raises(corbot.RobotNotFound, match="these are up: none"):
        corbot.connect("dead")


def has_name(address: str) -> bool:
    try:
        corbot.connect(address)
    except corbot.RobotNotFound:
        return False
    return True


def test_by_a_naming_service() -> None:
    with (simulation := simulated_with_naming()) as arm:
        service = simulation.processes["naming"].replace("corbaloc:", "corbaname:")
        until(
            lambda: has_name(f"{service}#Robots/{simulation.name}.Robot")
        )  # a thread of the servant binds the name
        for address in (service, service.removesuffix("/NameService")):
            assert corbot.connect(f"{address}#Robots/{simulation.name}.Robot").joint_names == arm.joint_names
        with pytest.raises(corbot.RobotNotFound, match=r"does not have the name Robots/nobody\.Robot"):
            corbot.connect(f"{service}#Robots/nobody.Robot")


def test_a_naming_service_that_does_not_answer() -> None:
    with pytest.raises(corbot.RobotNotFound, match="no naming service answers there"):
        corbot.connect("corbaname::127.0.0.1:1#Robots/lynx5.Robot")
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(corbot.RobotNotFound, match="no naming service answers"),
    ):
        corbot.connect(f"corbaname::127.0.0.1:{silent.getsockname()[1]}#Robots/lynx5.Robot", timeout=0.3)


def test_an_address_where_nobody_answers() -> None:
    with pytest.raises(corbot.RobotNotFound, match="nobody answers there") as raised:
        corbot.connect("127.0.0.1:1/lynx5", timeout=5.0)
    assert isinstance(raised.value, ConnectionError)


def test_an_address_that_closes_the_connection() -> None:
    def close() -> None:
        with contextlib.suppress(OSError):  # the server ends with the test
            while True:
                server.accept()[0].close()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=close, daemon=True).start()
        with pytest.raises(corbot.RobotNotFound, match="what answers there closed the connection"):
            corbot.connect(f"127.0.0.1:{server.getsockname()[1]}/lynx5", timeout=5.0)


def test_another_robot_at_the_address(here: Robot) -> None:
    address = here.arm.address.replace("/lynx5-", "/puma560-")
    with pytest.raises(corbot.RobotNotFound, match="has no robot of that name"):
        corbot.connect(address)


@pytest.mark.parametrize("text", ["IOR:zz", "corbaloc:what", "no name", "../lynx5"])
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(corbot.BadAddress, match="HOST:PORT/NAME") as raised:
        corbot.connect(text)
    assert raised.value.address == text


@pytest.mark.parametrize("robot", [5, b"lynx5", Path("lynx5")])
def test_what_is_no_text(robot: Any) -> None:
    with pytest.raises(TypeError, match="A robot is named by a text"):
        corbot.connect(robot)


@pytest.mark.parametrize("timeout", [0, -1, 0.0004, 1e12, float("nan")])
def test_a_timeout_has_bounds(timeout: float) -> None:
    with pytest.raises(ValueError, match=r"from 0\.001 to 3600 seconds"):
        corbot.connect("127.0.0.1:1/none", timeout=timeout)
