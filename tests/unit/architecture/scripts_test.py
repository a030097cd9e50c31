#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The scripts answer --help and refuse what they cannot do. The gate finds what tests left behind."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time
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

    def test_what_tests_left_behind_is_named(self):
        with tempfile.TemporaryDirectory() as directory:
            check = (f". {TOP}/scripts/common.sh; . {TOP}/scripts/phases.sh; cd {directory}; git init -q; "
                     f"changed=$(git status --porcelain); stamp={directory}/began; check_left_over")
            environment = os.environ | {"TMPDIR": directory}
            for left in ("build/release/tests/audit-1", "build/tsan/tests/state-2", "corbot-3"):
                path = pathlib.Path(directory, left)
                path.mkdir(parents=True)
                for age_s, status in ((10, 1), (-10, 0)):
                    with self.subTest(left, age_s=age_s):
                        began = pathlib.Path(directory, "began")
                        began.touch()
                        os.utime(began, (time.time() - age_s,) * 2)
                        answer = subprocess.run(["bash", "-c", check], env=environment, capture_output=True,
                                                text=True, timeout=60)
                        self.assertEqual(answer.returncode, status, answer.stderr)
                        self.assertEqual(left in answer.stderr, bool(status))
                path.rmdir()


class OneDefinition(unittest.TestCase):
    """The options of the part odr find a type of two definitions, also in an archive."""

    @unittest.skipUnless(shutil.which("g++"), "skipped: g++ not found")
    def test_a_type_of_two_definitions_is_found(self):
        presets = json.loads((TOP / "CMakePresets.json").read_text())["configurePresets"]
        odr = next(one for one in presets if one["name"] == "odr")
        compiler = ["g++", *odr["cacheVariables"]["CMAKE_CXX_FLAGS"].split()]
        for kind, status in (("int", 0), ("double", 1)):
            with self.subTest(kind), tempfile.TemporaryDirectory() as directory:
                for name, member in (("stops", "int"), ("main", kind)):
                    text = f"struct StopInput {{ {member} a; virtual {member} get(); }};\n"
                    text += ("int StopInput::get() { return a; }\nStopInput stop;\n" if name == "stops" else
                             "extern StopInput stop;\nint main() { return static_cast<int>(stop.get()); }\n")
                    pathlib.Path(directory, name + ".cpp").write_text(text)
                    subprocess.run([*compiler, "-c", name + ".cpp"], cwd=directory, check=True, timeout=60)
                subprocess.run(["ar", "qc", "libstops.a", "stops.o"], cwd=directory, check=True, timeout=60)
                answer = subprocess.run([*compiler, "main.o", "libstops.a"], cwd=directory,
                                        capture_output=True, text=True, timeout=60)
                self.assertEqual(bool(answer.returncode), bool(status), answer.stderr)
                self.assertEqual("Werror=odr" in answer.stderr, bool(status), answer.stderr)


if __name__ == "__main__":
    unittest.main()
