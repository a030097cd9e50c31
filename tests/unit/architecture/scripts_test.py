#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The scripts answer --help at once, and refuse what they cannot do."""
import pathlib
import subprocess
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]


def run(*command):
    return subprocess.run(command, cwd=TOP, capture_output=True, text=True, timeout=120)


class Scripts(unittest.TestCase):
    def test_each_that_builds_or_tests_prints_its_first_comment(self):
        scripts = [TOP / ".ci" / "run", TOP / "scripts" / "lint"]
        scripts += [path for path in (TOP / "scripts").iterdir() if "/common.sh\"\n" in path.read_text()]
        self.assertGreater(len(scripts), 10)
        for script in scripts:
            with self.subTest(script.name):
                answer = run(script, "--help")
                self.assertEqual((answer.returncode, answer.stderr), (0, ""))
                self.assertRegex(answer.stdout, r"\A[A-Z](.|\n)*\.\s")

    def test_a_wrong_argument_is_refused(self):
        for words, why in (
            ((".ci/run", "fast"), "takes no arguments, so 'fast' is refused"),
            (("scripts/demo", "--pieces"), "takes no arguments"),
            (("scripts/package", "x"), "takes no arguments"),
            (("scripts/lint", "src"), "the only option is --all"),
            (("scripts/standstill", "--sed", "1"), "--sed: the only option is --seed"),
            (("scripts/test", "-LE", "threads"), "-LE would bring in the tier long"),
            (("scripts/nightly", "moths"), "unknown part 'moths'"),
            (("scripts/same_code", "nosuch"), "'nosuch' is no commit"),
            (("scripts/words", "nofile.md"), "nofile.md: no such file"),
        ):
            with self.subTest(words):
                answer = run(*words)
                self.assertNotEqual(answer.returncode, 0)
                self.assertIn(why, answer.stdout + answer.stderr)


if __name__ == "__main__":
    unittest.main()
