# SPDX-License-Identifier: Apache-2.0
"""The end of Python, and processes that a program with an arm starts."""

from __future__ import annotations

import contextlib
import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import pytest
from omniORB import CORBA

import corbot
from conftest import Robot
from corbot import _orb
from corbot.simulation import _free_ports
from support import freeze, until

READERS = """
def read():
    while True:
        arm.state
for _ in range(4):
    threading.Thread(target=read, daemon=True).start()
time.sleep(0.3)
sys.exit(3)
"""
RECORDING = "recording = corbot.record(arm, rate=1000).__enter__()\ntime.sleep(0.3)\nsys.exit(3)"
MOTION = """
threading.Thread(target=lambda: arm.joints([20, 0, 0, 0], time=2), daemon=True).start()
time.sleep(0.3)
sys.exit(3)
"""
CAMERA = """
import sys, time, corbot
class Slow:
    def look(self, timeout):
        time.sleep(0.002)
        return []
    def picture(self, marked):
        return b""
corbot.serve_camera(Slow(), int(sys.argv[1]))
sys.exit(3)
"""
SLOW_ENDS = """
import omniORB, time
def end_slowly(event, _):
    if event == omniORB.WTHREAD_DELETED:
        print("a thread ends", flush=True)
        for _ in range(500):
            time.sleep(0.001)
omniORB.addWThreadHook(end_slowly)
"""
FORK = """
if os.fork() == 0:
    try:
        arm.state
    except RuntimeError as refusal:
        print(refusal, flush=True)
    os._exit(0)
os.wait()
print(arm.state.status)
"""


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program whose first argument is the address of the arm."""
    begin = "import os, sys, threading, time\nimport corbot\narm = corbot.connect(sys.argv[1])\n"
    return subprocess.run(
        [sys.executable, "-c", begin + program, *arguments], capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize("program", [READERS, RECORDING, MOTION], ids=["readers", "recording", "motion"])
def test_python_ends_with_its_own_exit_code_while_threads_call(program: str, arm: corbot.Arm) -> None:
    for _ in range(3):  # a thread may be elsewhere once
        ended = run(program, arm.address)
        assert (ended.returncode, ended.stderr) == (3, "")


def looks(camera: Any) -> None:
    with contextlib.suppress(CORBA.SystemException):  # the camera has ended
        while True:
            camera.Look(1.0)


def test_a_camera_ends_with_its_programs_exit_code_while_it_is_called() -> None:
    port = _free_ports(1)
    address = f"corbaloc::127.0.0.1:{port}/Camera"
    command = [sys.executable, "-c", CAMERA, str(port)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as child:
        until(lambda: serves(address))
        camera = _orb.connect(address, 2.0, _orb.Corbot.Camera)
        threads = [threading.Thread(target=looks, args=(camera,)) for _ in range(4)]
        for thread in threads:
            thread.start()
        camera.Look(1.0)
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=30)
        for thread in threads:
            thread.join()
    assert (child.returncode, errors) == (3, "")


def test_a_camera_ends_with_its_programs_exit_code_while_a_thread_of_the_orb_ends() -> None:
    port = _free_ports(1)
    address = f"corbaloc::127.0.0.1:{port}/Camera"
    ask = f"from corbot import _orb\n_orb.connect({address!r}, 2.0, _orb.Corbot.Camera).Look(1.0)"
    command = [sys.executable, "-c", SLOW_ENDS + CAMERA, str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        until(lambda: subprocess.run([sys.executable, "-c", ask], stderr=subprocess.DEVNULL).returncode == 0)
        assert child.stdout is not None
        assert child.stdout.readline() == "a thread ends\n", "since its connection has ended"
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=30)
    assert (child.returncode, errors) == (3, "")


def serves(address: str) -> bool:
    with contextlib.suppress(corbot.CorbotError):
        _orb.connect(address, 2.0, _orb.Corbot.Camera)
        return True
    return False


def test_a_forked_process_is_told_that_it_has_no_connection(arm: corbot.Arm) -> None:
    child, parent = run(FORK, arm.address).stdout.splitlines()
    assert child.startswith("A process that used corbot has forked this one")
    assert parent == "Status.STANDBY"


def test_a_process_that_is_forked_before_the_first_call_works(arm: corbot.Arm) -> None:
    program = (
        "import os, sys, corbot\n"
        "if os.fork() == 0:\n"
        "    print(corbot.connect(sys.argv[1]).state.status, flush=True)\n"
        "    os._exit(0)\n"
        "os.wait()"
    )
    output = subprocess.check_output([sys.executable, "-c", program, arm.address], text=True, timeout=60)
    assert output == "Status.STANDBY\n"


def test_an_arm_in_another_process_is_connected_anew(arm: corbot.Arm) -> None:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert pool.submit(status_of, arm).result(60) is corbot.Status.STANDBY


def status_of(arm: corbot.Arm) -> corbot.Status:
    return arm.state.status


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda arm: pickle.loads(pickle.dumps(arm))])
def test_a_copy_of_an_arm_has_its_timeout(copied: Callable[[corbot.Arm], corbot.Arm], fresh: Robot) -> None:
    copy_of_it = copied(corbot.connect(fresh.arm.address, timeout=0.5))
    servant = fresh.simulation.processes["servant_pid"]
    freeze(servant)
    try:
        with pytest.raises(corbot.NoAnswer):
            _ = copy_of_it.state
    finally:
        os.kill(servant, signal.SIGCONT)
