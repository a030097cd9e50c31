# SPDX-License-Identifier: Apache-2.0
"""Takes a piece from one place to another and returns, with a Lynx 5. pick_and_place.py [ROBOT]"""

import sys

import corbot

FROM, TO = (0.20, 0.08, 0.03), (0.20, -0.08, 0.03)  # the grasp, metres
ABOVE = 0.05


def transfer(arm: corbot.Arm) -> None:
    """Approach each place from above, in a line; with exclusive control no other client can interfere."""
    with arm.control("pick and place"):
        arm.ready()
        arm.open()
        arm.move(*FROM, above=ABOVE)
        arm.line(*FROM)
        arm.gripper(20)
        arm.line(*FROM, above=ABOVE)
        arm.move(*TO, above=ABOVE)
        arm.line(*TO)
        arm.open()
        arm.line(*TO, above=ABOVE)
        arm.ready()


if __name__ == "__main__":
    transfer(corbot.connect(sys.argv[1] if len(sys.argv) > 1 else None))
