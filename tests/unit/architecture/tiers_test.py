#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tiers_test.py CMAKE: a build with a test of no tier is not configured, nor one with a hidden thread."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]
CMAKE = "cmake"
# It needs no compiler, which would take most of the time.
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(tiers LANGUAGES NONE)
include({top}/cmake/targets.cmake)
enable_testing()
foreach(command IN ITEMS add_executable target_link_libraries target_compile_options set_target_properties
    add_dependencies corbot_target corbot_discover)
  function(${{command}})
  endfunction()
endforeach()
{tests}
"""


def configured(tests, source=""):
    """Returns the errors of a project with these tests, of which t.cpp is the source; empty: none."""
    with tempfile.TemporaryDirectory() as directory:
        pathlib.Path(directory, "t.cpp").write_text(f"int main() {{ {source} }}\n")
        pathlib.Path(directory, "CMakeLists.txt").write_text(PROJECT.format(top=TOP, tests=tests))
        answer = subprocess.run([CMAKE, "-G", "Ninja", "-S", directory, "-B", directory + "/build"],
                                timeout=120, capture_output=True, text=True)
        return " ".join(answer.stderr.split()) if answer.returncode else ""


class Tiers(unittest.TestCase):
    def test_each_test_has_one_of_them(self):
        for test in ("corbot_test({name} {tier} SOURCES t.cpp)",
                     "corbot_command_test({name} {tier} COMMAND true)"):
            with self.subTest(test):
                tiers = ("core", "process", "long")
                each = "\n".join(test.format(name=tier, tier="TIER " + tier) for tier in tiers)
                self.assertEqual(configured(each), "")
                self.assertIn("the test t has the tier ''", configured(test.format(name="t", tier="")))
                self.assertIn("the test t has the tier 'slow'",
                              configured(test.format(name="t", tier="TIER slow")))

    def test_a_core_test_that_starts_threads_says_so(self):
        thread = "std::thread([] {}).join();"
        for night in ("", " SANITIZED_AT_NIGHT"):
            self.assertIn("t.cpp starts threads: the core test t needs THREADS",
                          configured(f"corbot_test(t TIER core{night} SOURCES t.cpp)", thread))
        self.assertEqual(configured("corbot_test(t TIER core THREADS SOURCES t.cpp)", thread), "")
        self.assertIn("t: the thread sanitizer would run it neither",
                      configured("corbot_test(t TIER core THREADS SANITIZED_AT_NIGHT SOURCES t.cpp)", thread))

    def test_the_gate_runs_no_long_test_for_its_threads(self):
        label = ("function(corbot_discover name prefix cases label)\n  message(FATAL_ERROR ${label}!)\n"
                 "endfunction()\n")
        for tier, expected in (("long", "long!"), ("core", "core-threads!")):
            self.assertIn(f" {expected} ",
                          configured(f"{label}corbot_test(t TIER {tier} THREADS SOURCES t.cpp)"))


if __name__ == "__main__":
    CMAKE = sys.argv.pop(1)
    unittest.main()
