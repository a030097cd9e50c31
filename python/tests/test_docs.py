# SPDX-License-Identifier: Apache-2.0
"""The programs of docs/python.md and of both README.md, run as they are."""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import corbot
from corbot.simulation import find_program

TOP = Path(__file__).resolve().parents[2]
PAGE = TOP / "docs/python.md"
PICTURES = TOP / "docs/pictures"


def blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def run(program: str, directory: Path, python: str = sys.executable) -> str:
    environment = {**os.environ, "CORBOT_BIN": str(find_program())}
    ended = subprocess.run(
        [python, "-c", program],
        cwd=directory,
        env=environment,
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_the_page_runs_from_top_to_bottom(tmp_path: Path) -> None:
    has_cell = (find_program().parent / "corbot-scene").exists()
    output = run(
        "\n".join(block for block in blocks(PAGE) if has_cell or "simulated_cell" not in block), tmp_path
    )
    assert "The motion was stopped" in output or "short of the target" in output
    assert "Nothing moved" in output
    assert "\nAda\n" in output
    if has_cell:
        assert re.search("piece 1: held by robot1 at pallet1\n.*RobotWork", output), output
        assert "piece 1: placed by robot2 at pallet2" in output
    assert (tmp_path / "arm.svg").read_text() == (PICTURES / "python-arm.svg").read_text()
    for picture in (tmp_path / "run.svg", PICTURES / "python-run.svg"):
        assert "time (s)" in picture.read_text()


def test_the_page_names_every_example_and_exercise() -> None:
    text, folder = PAGE.read_text(encoding="utf-8"), TOP / "examples/python"
    programs = [file for file in folder.rglob("*.py") if "import corbot\n" in file.read_text()]
    assert len(programs) == 9
    assert {file.name for file in programs if f"`{file.name}`" not in text} == set()


def test_the_page_tests_an_arm(tmp_path: Path) -> None:
    example = next(block for block in blocks(PAGE) if block.startswith("def test_"))
    (tmp_path / "test_example.py").write_text(f"import corbot\n{example}")
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)],
        capture_output=True,
        text=True,
    )
    assert "1 passed" in ended.stdout, ended.stdout


def test_the_packages_readme_runs(tmp_path: Path) -> None:
    (program,) = blocks(TOP / "python/README.md")
    assert run(program, tmp_path).startswith("(14.0")


def test_readme_runs_with_the_packages_alone_that_the_wheel_declares(
    tmp_path: Path, simulated_arm: corbot.Arm
) -> None:
    (program,) = blocks(TOP / "README.md")
    assert len(program.splitlines()) == 5
    python = os.environ.get("CORBOT_CLEAN_PYTHON")
    if python is None:
        pytest.skip("CORBOT_CLEAN_PYTHON names no environment with the wheel alone")
    assert run(program.replace("lynx5", simulated_arm.address), tmp_path, python).startswith("(14.0")


def test_the_page_lists_every_exception() -> None:
    text = PAGE.read_text(encoding="utf-8")
    raised = {
        name
        for name, kind in vars(corbot).items()
        if inspect.isclass(kind) and issubclass(kind, corbot.CorbotError)
    }
    left_out = {"BadAddress", "OrbError", "SimulationFailed"}  # the text says enough
    assert {name for name in raised - left_out if f"`{name}`" not in text} == set()


@pytest.mark.parametrize("operation", ["move", "line", "joints", "drive", "gripper", "relative", "arc"])
def test_help_says_the_units(operation: str) -> None:
    text = inspect.getdoc(getattr(corbot.Arm, operation)) or ""
    assert re.search("metres|degrees|percent", text), text
