# SPDX-License-Identifier: Apache-2.0
"""Prints the joints and moves the tool, twice; the second point is out of reach. first_move.py [REFERENCE]"""
import pathlib
import signal
import sys

import omniORB

# omniidl makes the stubs, the module Corbot
omniORB.importIDL(str(pathlib.Path(__file__).resolve().parents[2] / 'idl/arm.idl'))
import Corbot

reference = sys.argv[1] if len(sys.argv) > 1 else 'corbaloc::127.0.0.1:12810/lynx5'
orb = omniORB.CORBA.ORB_init()
interrupted = []


def explain(error):
    """Each exception of the interface has fields of its own."""
    if isinstance(error, Corbot.LimitExceeded):
        joint = f' of joint {error.articulation}' if error.articulation >= 0 else ''
        limits = f'{error.lower:.4g} to {error.upper:.4g}'
        return f'{error.quantity}{joint}: {error.value:.4g} is not within {limits}'
    if isinstance(error, Corbot.QueueFull):
        return f'{error.capacity} motions or calls wait already: try again when one has ended'
    return getattr(error, 'reason', str(error))


signal.signal(signal.SIGINT, lambda *_: interrupted.append(True))  # an exception could end up inside the ORB

try:
    arm = orb.string_to_object(reference)._narrow(Corbot.Arm)
    for x, y, z in (0.20, 0.05, 0.08), (0.90, 0.00, 0.10):
        try:
            motion = arm.StartMove(x, y, z, 0.0, 0.0)  # metres; as fast as the limits allow
            while (info := arm.Wait(motion, 0.1)).state in (Corbot.MotionQueued, Corbot.MotionRunning):
                if interrupted:
                    arm.Stop()  # the end of this program would not stop the arm
            if info.reason:
                sys.exit(info.reason)
            print(f'moved to ({x}, {y}, {z}) m')
        except (Corbot.Unreachable, Corbot.LimitExceeded) as refusal:
            print('nothing moved:', explain(refusal), file=sys.stderr)
        print('joints', *(f'{angle:.1f}' for angle in arm._get_ArtiCoord()), 'degrees')
except omniORB.CORBA.TRANSIENT:
    sys.exit(f'nobody answers at {reference}: is the robot up?')
except omniORB.CORBA.Exception as error:
    sys.exit(f'{type(error).__name__}: {explain(error)}')
