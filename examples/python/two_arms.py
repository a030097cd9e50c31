# SPDX-License-Identifier: Apache-2.0
"""Moves two arms in step: each motion begins at once and lasts equally on both. two_arms.py ROBOT ROBOT"""

import argparse

import corbot

WAY = [[30, 20, 10, 0], [-30, 20, -10, 20], [0, 0, 0, 0]]  # joints, degrees
STEP = 1.0  # seconds of each motion


def dance(arms: list[corbot.Arm]) -> None:
    """Begin each motion on all arms before waiting for any; an exception stops all arms."""
    try:
        for target in WAY:
            motions = [arm.joints(target, time=STEP, wait=False) for arm in arms]
            for motion in motions:
                motion.wait()
    except BaseException:
        for arm in arms:
            arm.stop()
        raise


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("robot", nargs=2)
    dance([corbot.connect(name) for name in parser.parse_args().robot])
