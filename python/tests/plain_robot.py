# SPDX-License-Identifier: Apache-2.0
"""Serves a robot that has the interface of robot.idl alone, with one joint: plain_robot.py PORT"""

import os
import sys
import time

from corbot import _orb

orb = _orb.orb("-ORBendPoint", f"giop:tcp:127.0.0.1:{sys.argv[1]}")


class Plain(_orb.Corbot__POA.Robot):  # type: ignore[misc]
    angle = 0.0

    def Move(self, x: float, y: float, z: float, above: float, seconds: float) -> None:  # noqa: N802
        if x > 1:
            raise _orb.Corbot.Unreachable(_orb.Corbot.Point(x, y, z), "too far")
        if x < 0:
            os._exit(1)
        print("begins", flush=True)
        time.sleep(seconds)
        self.angle = x
        print("ends", flush=True)

    def _get_ArtiCoord(self) -> list[float]:  # noqa: N802
        return [self.angle]


poa = orb.resolve_initial_references("omniINSPOA")
poa.activate_object_with_id(b"plain", Plain())
poa._get_the_POAManager().activate()
print("serves", flush=True)
orb.run()
