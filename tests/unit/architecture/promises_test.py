#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""promises_test.py CTEST BUILD SAFETY: each test that docs/safety.md names is one of the gate's.

Each of them is in the build's list of tests, and no case of it has the label long. The text says "in the rig"
of the tests that are skipped elsewhere.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

NAMED_TEST = re.compile(r"`([A-Z]\w*\.[A-Z]\w*)`")
TEST = re.compile(r"(\w+\.\w+)(?:/|$)")  # in Instance/Suite.Case/parameter, and after the name of an ORB
IN_THE_RIG = re.compile(r"in the rig,? ((?:`\w+\.\w+`(?:, )?)+)")
# Their fixtures skip them without emulated GPIO lines.
ONLY_IN_THE_RIG = re.compile(r"WatchdogLine\.|Press\.OfAGpioLine$")


def labels_of(ctest, build):
    """Returns the labels of all cases of each test, by the test's name.

    CTest opens its log also to list tests. It does so in a directory of its own here, because the run that
    includes this test writes the log of `build`.
    """
    with tempfile.TemporaryDirectory() as directory:
        pathlib.Path(directory, "CTestTestfile.cmake").write_text(f'subdirs("{build}")\n')
        listed = subprocess.run([ctest, "--test-dir", directory, "--show-only=json-v1"], check=True,
                                stdout=subprocess.PIPE, text=True).stdout
    found = {}
    for test in json.loads(listed)["tests"]:
        name = TEST.search(test["name"])
        labels = [one["value"] for one in test["properties"] if one["name"] == "LABELS"]
        if name:
            found.setdefault(name[1], set()).update(labels[0] if labels else ["no label"])
    return found


def faults_of(text, labels):
    """Returns a line for each test that `text` names and that the gate does not run."""
    faults = []
    for name in sorted(set(NAMED_TEST.findall(text))):
        if name not in labels:
            faults.append(f"no program of this build has the test {name}")
        elif not all(re.match("core|process", label) for label in labels[name]):
            faults.append(f"a case of {name} has a label that the gate does not run: {sorted(labels[name])}")
    in_the_rig = set(NAMED_TEST.findall(" ".join(IN_THE_RIG.findall(text))))
    skipped = set(filter(ONLY_IN_THE_RIG.match, NAMED_TEST.findall(text)))
    return faults + [f"{name} is not marked as one of the rig alone" for name in skipped - in_the_rig] + [
        f"{name} does not need the rig" for name in in_the_rig - skipped]


def main(ctest, build, safety):
    planted = faults_of("`Stop.Bare`, `Stop.Gone`, `Stop.Good`, `WatchdogLine.Bare`, `Stop.Long`, in the rig "
                        "`WatchdogLine.Good`, `Stop.Here`",
                        {"Stop.Bare": {"no label"}, "Stop.Good": {"core-threads"}, "Stop.Here": {"core"},
                         "Stop.Long": {"core", "long"}, "WatchdogLine.Good": {"process"},
                         "WatchdogLine.Bare": {"process"}})
    if [fault.count("Good") for fault in planted] != [0, 0, 0, 0, 0]:
        print(f"of five planted breaches these were found: {planted}")
        return 1
    labels = labels_of(ctest, build)
    faults = faults_of(pathlib.Path(safety).read_text(), labels)
    for fault in faults:
        print(f"docs/safety.md: {fault}")
    return 1 if faults or not labels else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
