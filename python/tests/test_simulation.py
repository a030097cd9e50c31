# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import corbot
from corbot.simulation import _free_ports, find_profile, find_program
from support import until


def is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_no_port_is_one_of_the_profiles() -> None:
    assert all(2000 <= _free_ports(8) <= 9992 for _ in range(200))


def test_the_robot_is_taken_down_at_the_end() -> None:
    robot = corbot.simulated()
    with robot:
        processes = [robot.processes[key] for key in ("pid", "servant_pid", "rt_pid")]
        assert all(map(is_alive, processes))
        until(lambda: f"{robot.name} is up" in robot.output)  # some lines after the address
    assert not robot.directory.exists()
    until(lambda: not any(map(is_alive, processes)))
    robot.end()
    with pytest.raises(corbot.SimulationFailed, match="has ended, and its output with it"):
        _ = robot.output
    with pytest.raises(corbot.SimulationFailed, match=r"is not up.*Call start\(\)"):
        robot.wait(1)


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_a_robot_that_starts_again_at_its_port_is_found(
    end: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = _free_ports(1)
    monkeypatch.setattr(corbot.simulation, "_free_ports", lambda _: port)
    robot = corbot.simulated()
    for _ in range(2):  # the client keeps its connection to the first
        with robot as arm:
            assert arm.state.status is corbot.Status.STANDBY
            os.kill(robot.processes["servant_pid"], end)


def test_the_end_of_one_that_was_never_started_has_no_effect() -> None:
    corbot.simulated().end()


def test_a_program_that_outlives_corbot_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "corbot"
    steps = 'mkdir -p "$0"; true > "$0/$i"'  # `:` would end the shell where the directory has just gone
    write = f'i=0; while [ $i -lt 30 ]; do {steps}; sleep 0.01; i=$((i+1)); done; : > "$1"'
    begin = f"sh -c '{write}' \"$XDG_RUNTIME_DIR/state\" {tmp_path}/ended &"
    program.write_text(f"#!/bin/sh\n{begin}\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("CORBOT_PROFILES", str(find_profile("lynx5", find_program()).parent))
    monkeypatch.setenv("CORBOT_BIN", str(program))
    robot = corbot.simulated("lynx5")
    with pytest.raises(corbot.SimulationFailed):
        robot.start()
    until((tmp_path / "ended").exists)
    until(lambda: not robot.directory.exists())


def test_a_start_of_one_that_is_up_finds_it() -> None:
    robot = corbot.simulated()
    with robot as arm:
        arm.joints([5, 0, 0, 0])
        pid = robot.processes["pid"]
        assert robot.start().state.joints == pytest.approx((5, 0, 0, 0), abs=1e-3)
        assert robot.processes["pid"] == pid
        os.kill(pid, signal.SIGTERM)
        robot.wait(30)
        before = robot.directory
        assert robot.start().state.status is corbot.Status.STANDBY
        assert robot.processes["pid"] != pid
        assert not before.exists()


def test_the_end_of_python_takes_the_robot_down() -> None:
    program = (
        "import corbot\nrobot = corbot.simulated()\nrobot.start()\n"
        "print(robot.processes['pid'], robot.directory)"
    )
    pid, directory = subprocess.check_output([sys.executable, "-c", program], text=True).split()
    assert not is_alive(int(pid))
    assert not Path(directory).exists()


def test_a_program_that_ignores_the_end_of_its_children_ends_a_robot() -> None:
    program = (
        "import corbot, signal, time\nsignal.signal(signal.SIGCHLD, signal.SIG_IGN)\n"
        "with corbot.simulated():\n    begun = time.monotonic()\nprint(time.monotonic() - begun)"
    )
    assert float(subprocess.check_output([sys.executable, "-c", program], text=True)) < 10.0


@pytest.mark.parametrize("end", ["sys.exit()", "robot.end()"])
def test_the_end_of_a_fork_leaves_the_robot_up(end: str) -> None:
    program = (
        "import os, sys, corbot\nrobot = corbot.simulated()\narm = robot.start()\n"
        f"if os.fork() == 0:\n    {end}\n    os._exit(0)\n"
        "os.wait()\narm.joints([5, 0, 0, 0])\nprint(robot.output != '', *arm.state.joints)"
    )
    output, *joints = subprocess.check_output([sys.executable, "-c", program], text=True).split()
    assert output == "True"
    assert [float(joint) for joint in joints] == pytest.approx((5, 0, 0, 0), abs=1e-3)


def test_a_killed_python_without_a_path_leaves_nothing_behind() -> None:
    program = "import corbot, os, signal\ncorbot.simulated().start()\nos.kill(os.getpid(), signal.SIGKILL)"
    environment = {**os.environ, "CORBOT_BIN": str(find_program()), "PATH": "/nonexistent"}
    with tempfile.TemporaryDirectory() as here:  # shorter than tmp_path, for a socket's path
        ended = subprocess.run([sys.executable, "-c", program], env={**environment, "TMPDIR": here})
        assert ended.returncode == -signal.SIGKILL
        until(lambda: not os.listdir(here), within=30)


def test_a_temporary_directory_may_be_relative() -> None:
    program = "import corbot\nwith corbot.simulated() as arm:\n    print(arm.state.status)"
    environment = {**os.environ, "CORBOT_BIN": str(find_program()), "TMPDIR": "."}
    with tempfile.TemporaryDirectory() as here:
        output = subprocess.check_output(
            [sys.executable, "-c", program], env=environment, cwd=here, text=True, timeout=30
        )
    assert output == "Status.STANDBY\n"


@pytest.mark.parametrize("what", ["robot", "cell"])
def test_a_python_that_is_killed_leaves_nothing_behind(what: str) -> None:
    make = {"robot": "corbot.simulated()", "cell": "corbot.simulated_cell(pieces=12)"}[what]
    program = (
        f"import corbot, time\nrun = {make}\nrun.start()\nprint(run.directory, flush=True)\ntime.sleep(600)"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    with child.stdout:
        directory = child.stdout.readline().strip()
    assert processes_of(directory)
    child.kill()
    child.wait()
    until(lambda: not processes_of(directory) and not Path(directory).exists(), within=30)


def processes_of(directory: str) -> list[int]:
    """Give the processes that have the directory in their command line or in their environment."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if directory.encode() in (process / "cmdline").read_bytes() + (process / "environ").read_bytes():
                found.append(int(process.name))
    return found


def test_two_at_once_are_two_robots() -> None:
    with corbot.simulated("lynx5") as one, corbot.simulated("lynx5") as two:
        one.joints([5, 0, 0, 0])
        assert two.state.joints[0] == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("simulated_arm", ["puma560"], indirect=True)
def test_the_fixture_takes_a_profile(simulated_arm: corbot.Arm) -> None:
    assert len(simulated_arm.state.joints) == 6


def test_the_fixture_is_a_lynx_5(simulated_arm: corbot.Arm) -> None:
    assert simulated_arm.joint_names == ("base", "shoulder", "elbow", "wrist")


def test_an_unknown_profile_is_answered_with_those_that_are_there() -> None:
    with pytest.raises(corbot.SimulationFailed, match="lynx5.*puma560"):
        corbot.simulated("lynx6")
    with pytest.raises(corbot.SimulationFailed, match="no profile ./nowhere.toml"):
        corbot.simulated("./nowhere.toml")
    with pytest.raises(corbot.SimulationFailed, match=r"no profile nowhere\.toml"):
        corbot.simulated(Path("nowhere.toml"))
    with pytest.raises(TypeError, match="not NoneType"):
        corbot.simulated(None)  # type: ignore[arg-type]


def test_profiles_of_a_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine.toml").touch()
    monkeypatch.setenv("CORBOT_PROFILES", str(tmp_path))
    assert find_profile("mine", find_program()) == tmp_path / "mine.toml"
    with pytest.raises(corbot.SimulationFailed, match="These are: mine"):
        find_profile("lynx5", find_program())


def test_a_profile_that_is_refused_shows_why(tmp_path: Path) -> None:
    profile = tmp_path / "bad.toml"
    profile.write_text("[robot]\nname = 5\n")
    with pytest.raises(corbot.SimulationFailed, match=r"bad\.toml") as raised, corbot.simulated(str(profile)):
        pass
    assert "name" in raised.value.output


def test_a_profile_that_drives_a_device_is_refused() -> None:
    with pytest.raises(corbot.SimulationFailed) as raised, corbot.simulated("lynx5-can"):
        pass
    assert "drives a device" in raised.value.output


def test_the_program_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = find_program()
    for given in (program, program.parent):
        monkeypatch.setenv("CORBOT_BIN", str(given))
        assert find_program() == program
    monkeypatch.delenv("CORBOT_BIN")
    monkeypatch.setenv("PATH", str(program.parent))
    assert find_program() == program


def test_the_program_is_found_in_a_build_above(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = tmp_path / "build/release/bin/corbot"
    built.parent.mkdir(parents=True)
    built.touch()
    (tmp_path / "below").mkdir()
    (tmp_path / "profiles").mkdir()
    (tmp_path / "profiles/mine.toml").touch()
    monkeypatch.chdir(tmp_path / "below")
    monkeypatch.delenv("CORBOT_PROFILES", raising=False)
    monkeypatch.delenv("CORBOT_BIN", raising=False)
    monkeypatch.setenv("PATH", "/nonexistent")
    assert find_program() == built
    assert find_profile("mine", built) == tmp_path / "profiles/mine.toml"


def test_a_missing_program_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CORBOT_BIN", str(tmp_path))
    with pytest.raises(corbot.SimulationFailed, match="there is no program corbot"):
        find_program()
    monkeypatch.delenv("CORBOT_BIN")
    monkeypatch.setenv("PATH", "/nonexistent")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(corbot.SimulationFailed, match="set CORBOT_BIN"):
        find_program()


def test_ctrl_c_in_a_terminal_does_not_reach_the_robot() -> None:
    """A client needs the servant for its Stop."""
    robot = corbot.simulated()
    with robot:
        session = subprocess.run(
            ["ps", "-o", "sid=", "-p", str(robot.processes["pid"])], capture_output=True, text=True
        )
        assert int(session.stdout) != os.getsid(0)


def test_a_program_without_profiles_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CORBOT_PROFILES", raising=False)
    with pytest.raises(
        corbot.SimulationFailed, match=r"No profile is there: set \$CORBOT_PROFILES to the directory"
    ):
        find_profile("lynx5", tmp_path / "bin/corbot")
