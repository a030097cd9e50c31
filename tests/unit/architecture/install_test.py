# SPDX-License-Identifier: Apache-2.0
"""An installation holds what docs/install/package.md says, and finds its own files.

Arguments: CMake, the build directory.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]
CMAKE, BUILD = sys.argv.pop(1), sys.argv.pop(1)


class Installation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.root = pathlib.Path(cls.folder.name)
        subprocess.run([CMAKE, "--install", BUILD, "--prefix", cls.root], check=True, capture_output=True)

    def test_every_program_that_the_page_names_is_there_and_runs(self):
        page = (TOP / "docs/install/package.md").read_text()
        row = next(line for line in page.splitlines() if line.startswith("| `bin`"))
        programs = re.findall(r"`(corbot[a-z-]*)`", row)
        self.assertGreaterEqual(len(programs), 6)
        for program in programs:
            result = subprocess.run([self.root / "bin" / program, "--help"], capture_output=True, text=True)
            self.assertEqual(result.returncode, 0, program + result.stderr)

    def test_the_completion_completes(self):
        script = (f". '{self.root}/share/bash-completion/completions/corbot'; "
                  "COMP_WORDS=(corbot sta); COMP_CWORD=1; "
                  "$(complete -p corbot | sed 's/.*-F \\([^ ]*\\).*/\\1/'); echo \"${COMPREPLY[@]}\"")
        result = subprocess.run(["bash", "-c", script], capture_output=True, text=True)
        self.assertIn("status", result.stdout, result.stderr)

    def test_the_manual_page_is_where_man_looks(self):
        self.assertIn(".TH CORBOT 1", (self.root / "share/man/man1/corbot.1").read_text())

    def test_an_installed_profile_is_found_by_its_name(self):
        result = subprocess.run([self.root / "bin/corbot", "up", "lynx5"], cwd=self.root, capture_output=True,
                                text=True)
        self.assertEqual(result.returncode, 2)
        self.assertIn(f"did you mean '{self.root}/share/corbot/profiles/lynx5.toml'?", result.stderr)


unittest.main()
