# SPDX-License-Identifier: Apache-2.0
"""The programs of docs/python.md and README.md, run as they are."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import corbot

TOP = Path(__file__).resolve().parents[2]
PAGE = TOP / "docs/python.md"


def blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def run(program: str) -> str:
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_the_page_runs_from_top_to_bottom() -> None:
    output = run("\n".join(blocks(PAGE)))
    assert "The motion was stopped" in output or "short of the target" in output
    assert "Nothing moved" in output
    assert output.splitlines()[-1] == "Ada"


def test_the_page_tests_an_arm(tmp_path: Path) -> None:
    example = next(block for block in blocks(PAGE) if block.startswith("def test_"))
    (tmp_path / "test_example.py").write_text(f"import corbot\n{example}")
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)], capture_output=True, text=True
    )
    assert "1 passed" in ended.stdout, ended.stdout


def test_readme_runs() -> None:
    (program,) = blocks(TOP / "python/README.md")
    assert run(program).startswith("(14.0")


def test_the_page_lists_every_exception() -> None:
    text = PAGE.read_text(encoding="utf-8")
    raised = {name for name, kind in vars(corbot).items() if inspect.isclass(kind) and issubclass(kind, corbot.CorbotError)}
    left_out = {"BadAddress", "OrbError", "SimulationFailed"}  # the text says enough
    assert {name for name in raised - left_out if f"`{name}`" not in text} == set()


@pytest.mark.parametrize("operation", ["move", "line", "joints", "drive", "gripper", "relative", "arc"])
def test_help_says_the_units(operation: str) -> None:
    text = inspect.getdoc(getattr(corbot.Arm, operation)) or ""
    assert re.search("metres|degrees|percent", text), text
