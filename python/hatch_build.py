# SPDX-License-Identifier: Apache-2.0
"""Makes the stubs of the interface while the wheel is built.

A program then needs neither omniidl nor a temporary directory when it starts. The stubs lie in a package of
their own, so a file system that ignores case cannot confuse the module Corbot with the package corbot.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FILES = ("robot.idl", "arm.idl", "cell.idl")
OMNIIDL = "from omniidl.main import main; main()"


class StubsHook(BuildHookInterface):  # type: ignore[misc]
    """Adds the stubs and the IDL files to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Run omniidl; the sdist has the IDL files in idl, the tree in ../idl."""
        if self.target_name != "wheel":
            return
        root = Path(self.root)
        idl = next(found for found in (root / "idl", root.parent / "idl") if (found / FILES[0]).is_file())
        self.made = tempfile.TemporaryDirectory(prefix="corbot-stubs-")  # removed with this object
        subprocess.run(
            [
                sys.executable,
                "-c",
                OMNIIDL,
                "-bpython",
                "-Wbpackage=corbot._stubs",
                f"-C{self.made.name}",
                f"-I{idl}",
            ]
            + [str(idl / file) for file in FILES],
            check=True,
        )
        included = {f"{self.made.name}/corbot/_stubs": "corbot/_stubs"}
        included |= {str(idl / file): f"corbot/idl/{file}" for file in FILES}
        build_data["force_include"].update(included)
