# SPDX-License-Identifier: Apache-2.0
"""Runs the scenario of tests/interop through the package.

Each call uses the package's own method if there is one.
"""

from __future__ import annotations

import enum
import math
import os
import re
import signal
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import pytest

import corbot
from corbot import _orb
from corbot.simulation import Simulation
from support import simulated_with_naming, skip_without, until

INTEROP = Path(__file__).resolve().parents[2] / "tests/interop"
OVERRUN = 140  # an alarm that only says that this machine is busy


def motions(wait: bool) -> dict[str, Callable[..., corbot.Motion]]:
    """The package's methods by the interface's names of the motions."""

    def relative(
        arm: corbot.Arm, offset: corbot.Pose, axes: Any, time: float, line: bool = False
    ) -> corbot.Motion:
        return arm.relative(
            *offset.position,
            turn=offset.orientation,
            frame="base" if axes == _orb.Corbot.OffsetInBase else "tool",
            line=line,
            time=time,
            wait=wait,
        )

    return {
        "Move": lambda arm, x, y, z, above, time: arm.move(x, y, z, above=above, time=time, wait=wait),
        "MoveS": lambda arm, x, y, z, above, time: arm.line(x, y, z, above=above, time=time, wait=wait),
        "MoveC": lambda arm, *points: arm.arc(*points, wait=wait),
        "MovePose": lambda arm, pose, time: arm.pose(pose, time=time, wait=wait),
        "MovePoseS": lambda arm, pose, time: arm.pose(pose, line=True, time=time, wait=wait),
        "MoveRelative": relative,
        "MoveRelativeS": lambda arm, offset, axes, time: relative(arm, offset, axes, time, line=True),
        "MoveJoints": lambda arm, target, time: arm.joints(target, time=time, wait=wait),
        "Drive": lambda arm, joint, by, speed: arm.drive(joint, by, speed=speed, wait=wait),
        "Ready": lambda arm: arm.ready(wait=wait),
        "Delay": lambda arm, seconds: arm.delay(seconds, wait=wait),
        "Open": lambda arm: arm.open(wait=wait),
        "Close": lambda arm: arm.close(wait=wait),
        "SetGripper": lambda arm, percent: arm.gripper(percent, wait=wait),
    }


def wait_for(arm: corbot.Arm, number: int, timeout: float) -> Any:
    if timeout < 0:
        return arm.call("Wait", number, timeout)  # which Motion.wait takes for 0
    motion = corbot.Motion(arm, number)
    try:
        return motion.wait(timeout)
    except corbot.Stopped:
        return motion.info


CALLS: dict[str, Callable[..., Any]] = {
    **motions(wait=True),
    **{f"Start{name}": start for name, start in motions(wait=False).items()},
    "Wait": wait_for,
    "Progress": lambda arm, number: corbot.Motion(arm, number).info,
    "Cancel": lambda arm, number: corbot.Motion(arm, number).cancel(),
    "Stop": corbot.Arm.stop,
    "StopAndHold": corbot.Arm.hold,
    "Clear": corbot.Arm.clear,
    "Pause": corbot.Arm.pause,
    "Resume": corbot.Arm.resume,
    "Speed": lambda arm, percent: arm.set_speeds(tool=percent),
    "AllSpeed": lambda arm, percent: arm.set_speeds(joints=percent),
    "Override": corbot.Arm.override,
    "SetToolPitch": corbot.Arm.set_tool_pitch,
    "SetToolOrientation": corbot.Arm.set_tool_orientation,
    "ResetToolOrientation": lambda arm: arm.set_tool_orientation(None),
    "ResetSoftLimits": corbot.Arm.reset_limits,
    "ResetWorkspace": corbot.Arm.reset_workspace,
    "SetToolFrame": lambda arm, pose: arm.set_frames(tool=pose),
    "SetBaseFrame": lambda arm, pose: arm.set_frames(base=pose),
    "ResetFrames": corbot.Arm.reset_frames,
    "Solutions": corbot.Arm.solutions,
}
READS: dict[str, Callable[[corbot.Arm], Any]] = {
    "RobotType": lambda arm: getattr(_orb.Corbot, arm.kind),
    "DoF": lambda arm: len(arm.joint_names),
    "Reach": lambda arm: arm.reach,
    "MovRange": lambda arm: [{"lower": joint.lower, "upper": joint.upper} for joint in arm.limits],
    "SoftLimits": lambda arm: [
        {"lower": joint.soft_lower, "upper": joint.soft_upper} for joint in arm.limits
    ],
    "Workspace": lambda arm: arm.workspace,
    "ArtiCoord": lambda arm: arm.state.joints,
    "Status": lambda arm: arm.state.status,
    "OverridePercent": lambda arm: arm.state.override,
    "Gripper": lambda arm: arm.state.gripper,
    "Control": lambda arm: arm.state.control,
    "Alarms": lambda arm: [alarm for alarm in arm.alarms if alarm.code != OVERRUN],
    "ToolPitch": lambda arm: arm.tool_pitch,
    "ToolFrame": lambda arm: arm.frames.tool,
    "BaseFrame": lambda arm: arm.frames.base,
    "Solution": lambda arm: arm.solution,
    "Description": lambda arm: arm.description,
}


def text(value: Any) -> str:
    """Write a value of the package or of the interface as the scenario does."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'
    if isinstance(value, enum.Enum):
        return str(value.value)
    if hasattr(value, "_n"):
        return str(value)  # a member of one of the interface's enumerations
    if hasattr(value, "_narrow"):
        return str(_orb.orb().object_to_string(value))
    if isinstance(value, (list, tuple)) and not hasattr(value, "_asdict"):
        return f"[{' '.join(map(text, value))}]"
    members = (
        value._asdict() if hasattr(value, "_asdict") else value if isinstance(value, dict) else vars(value)
    )
    if isinstance(value, corbot.LimitExceeded):
        members = {
            name: member for name, member in members.items() if name != "unit"
        }  # the interface has none
    names = {"number": "id"} if isinstance(value, corbot.MotionInfo) else {"joint": "articulation"}
    return (
        "{"
        + " ".join(
            f"{names.get(name, name)}={text(member)}" for name, member in members.items() if name[0] != "_"
        )
        + "}"
    )


def tokens(answer: str) -> list[str]:
    return re.findall(r'"(?:\\.|[^"\\])*"|[][{}=]|[^][{}= ]+', answer)


def end_of_value(have: list[str], at: int) -> int:
    depth = 0
    while True:
        depth += (have[at] in "{[") - (have[at] in "}]")
        at += 1
        if depth == 0:
            return at


def equal(expected: str, token: str) -> bool:
    try:
        a, b = float(expected), float(token)
    except ValueError:
        return fnmatchcase(token, expected)
    return (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-6)


def matches(expected: str, answer: str) -> bool:
    """Whether the answer is what the scenario expects: numbers to 1e-6, * is any value."""
    have, at = tokens(answer), 0
    for token in tokens(expected):
        if at >= len(have) or (token == "*" and have[at] in "}]"):
            return False
        if token != "*" and not equal(token, have[at]):
            return False
        at = end_of_value(have, at) if token == "*" else at + 1
    return at == len(have)


def arguments(words: list[str], end: str = "") -> list[Any]:
    """Read arguments up to the bracket `end`, and take them from the words."""
    found: list[Any] = []
    while words and (word := words.pop(0)) != end:
        if word == "{":
            members = arguments(words, "}")
            found.append({2: corbot.Pose, 3: corbot.Point, 4: corbot.Quaternion}[len(members)](*members))
        elif word == "[":
            found.append(arguments(words, "]"))
        elif re.match(r"[-.\d]|nan$|inf$", word):
            found.append(int(word) if word.lstrip("-").isdigit() else float(word))
        else:
            found.append(getattr(_orb.Corbot, word, word))
    return found


def raised(error: Exception) -> str:
    match error:
        case corbot.NoControl():
            return "exception SYSTEM:NO_PERMISSION"
        case corbot.RobotNotFound():
            return f"exception NotFound {text(error)}"
        case corbot.CorbotError():
            return f"exception {type(error).__name__} {text(error)}"
    return f"exception SYSTEM:{type(error).__name__}"  # the package refuses what the interface cannot carry


class Client:
    """Carries out the commands of the scenario, and answers each with one line."""

    def __init__(self) -> None:
        self._pool, self._begun = ThreadPoolExecutor(8), dict[str, Future[str]]()

    def ask(self, line: str) -> str:
        command, _, rest = line.partition(" ")
        first, _, more = rest.partition(" ")
        try:
            match command:
                case "connect":
                    self.arm = corbot.connect(first)
                case "resolve":
                    self.arm = corbot.connect(
                        f"{first.replace('corbaloc:', 'corbaname:').removesuffix('/NameService')}#{more}"
                    )
                case "get":
                    read = READS.get(first)
                    return f"ok {text(read(self.arm) if read else self.arm.call(f'_get_{first}'))}"
                case "call":
                    return self._call(first, more)
                case "begin":
                    self._begun[first] = self._pool.submit(self.ask, f"call {more}")
                case "end":
                    return self._begun.pop(first).result(60)
                case _:
                    pytest.fail(f"no command {command}")
        except (corbot.CorbotError, TypeError, ValueError) as error:
            return raised(error)
        return "ok"

    def _call(self, operation: str, line: str) -> str:
        of = arguments(re.sub(r"([][{}])", r" \1 ", line).split())
        call = CALLS.get(operation)
        result = call(self.arm, *of) if call else self.arm.call(operation, *of)
        if isinstance(result, corbot.Motion):
            return f"ok {result.number}" if operation.startswith("Start") else "ok"
        return "ok" if result is None else f"ok {text(result)}"


def values_of(arm: str) -> dict[str, str]:
    lines = (INTEROP / f"arms/{arm}.txt").read_text(encoding="utf-8").splitlines()
    return dict(line.split(" = ", 1) for line in lines if " = " in line and line[0] != "#")


def lines_for(parts: list[str]) -> list[str]:
    """The lines of the scenario that are for an arm with these parts."""
    lines, wanted = [], True
    for line in (INTEROP / "scenario.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("for "):
            wanted = line[4:] in parts
        elif wanted and line and line[0] != "#":
            lines.append(line)
    return lines


class Scenario:
    """The scenario with one robot."""

    def __init__(self, simulation: Simulation, values: dict[str, str]) -> None:
        self._simulation, self._values, self._client = simulation, values, Client()
        self.steps = 0

    def run(self) -> None:
        lines = lines_for(self._values["parts"].split())
        while lines:
            line = self._filled_in(lines.pop(0))
            expected = self._filled_in(lines.pop(0)[2:]) if lines and lines[0].startswith("= ") else None
            self._step(line, expected)
            self.steps += 1

    def _filled_in(self, line: str) -> str:
        while (filled := re.sub(r"\$(\w+)", lambda name: self._values[name[1]], line)) != line:
            line = filled
        return line

    def _step(self, line: str, expected: str | None) -> None:
        if line.startswith("device "):
            number = signal.SIGUSR1 if line == "device lost" else signal.SIGUSR2
            os.kill(self._simulation.processes["rt_pid"], number)
        elif found := re.fullmatch(r"until (.*): (\w.*)", line):
            answer, command = found.groups()
            until(lambda: matches(answer, self._client.ask(command)), within=60)
        elif found := re.fullmatch(r"let (\w+) = (.*)", line):
            answer = self._client.ask(found[2])
            assert answer.startswith("ok "), f"{line}\n  answered {answer}"
            self._values[found[1]] = answer[3:]
        else:
            answer = self._client.ask(line)
            good = answer.startswith("ok") if expected is None else matches(expected, answer)
            assert good, f"{line}\n  answered {answer}\n  expected {expected or 'ok'}"


@pytest.mark.parametrize("orb", ["omniorb", "orbit2"])
def test_the_package_sees_what_every_client_sees(orb: str) -> None:
    skip_without(orb)
    simulation = simulated_with_naming(orb)
    with simulation as arm:
        places = {"corbaloc": arm.address, "naming": simulation.processes["naming"], "name": simulation.name}
        scenario = Scenario(simulation, values_of("lynx5") | places)
        scenario.run()
    assert scenario.steps > 150, "the scenario is cut"


def test_answers_are_compared_by_value() -> None:
    assert matches("ok [0 1 2.5]", "ok [0.0 1 2.5000001]")
    assert not matches("ok [0 1 2.5]", "ok [0 1 2.6]")
    assert not matches("ok [0 1]", "ok [0 1 2]")
    assert matches('ok {id=* text="a*"}', 'ok {id={x=1 y=[2]} text="a b = c"}')
    assert not matches('ok {id=* text="a*"}', 'ok {id={x=1 y=[2]} text="b"}')
    assert matches("value=nan", "value=nan")
    assert not matches("value=nan", "value=0")
    assert not matches("ok", "ok 1")
