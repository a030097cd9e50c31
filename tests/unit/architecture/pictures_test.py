# SPDX-License-Identifier: Apache-2.0
"""The pictures of docs/pictures are as new as their inputs, and scripts/pictures --check finds each fault.

Takes no arguments.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]


def check(root):
    result = subprocess.run([sys.executable, TOP / "scripts/pictures", "--check", "--root", root],
                            capture_output=True,
                            text=True)
    return result.returncode, result.stdout + result.stderr


class Pictures(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)
        for name in ("docs/pictures", "profiles", "python/src", "sim/scene", "src/cell", "src/cli",
                     "src/planner"):
            shutil.copytree(TOP / name, self.root / name)
        shutil.copytree(TOP / "page", self.root / "page", ignore=shutil.ignore_patterns("node_modules"))

    def expect_fault(self, text):
        code, output = check(self.root)
        self.assertEqual(code, 1)
        self.assertIn(text, output)
        self.assertIn("run scripts/pictures", output)

    def test_are_as_new_as_their_inputs(self):
        self.assertEqual(check(TOP), (0, ""))

    def test_of_a_changed_profile_are_old(self):
        with open(self.root / "profiles/omx.toml", "a") as profile:
            profile.write("# longer\n")
        self.expect_fault("docs/pictures/arms/omx.svg: is older")
        self.assertNotIn("lynx5", check(self.root)[1])

    def test_of_changed_drawing_are_old(self):
        with open(self.root / "src/cli/arm/panel.cpp", "a") as source:
            source.write("// other\n")
        self.expect_fault("docs/pictures/arms/lynx5-small.svg: is older")

    def test_of_another_change_are_not_old(self):
        with open(self.root / "src/planner/planner.cpp", "a") as source:
            source.write("// other\n")
        self.assertEqual(check(self.root), (0, ""))

    def test_missing_unlisted_and_large_ones_are_found(self):
        picture = self.root / "docs/pictures/arms/omx.svg"
        picture.unlink()
        self.expect_fault("arms/omx.svg: is missing")
        picture.write_bytes(b" " * 300_001)
        self.expect_fault("arms/omx.svg: has 300001 bytes")
        (self.root / "docs/pictures/stray.svg").write_text("<svg/>")
        self.expect_fault("stray.svg: is not listed")

    def test_of_a_new_profile_is_missing(self):
        shutil.copy(self.root / "profiles/omx.toml", self.root / "profiles/new.toml")
        self.expect_fault("arms/new.svg: is missing")


if __name__ == "__main__":
    unittest.main()
