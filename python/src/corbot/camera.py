# SPDX-License-Identifier: Apache-2.0
"""A custom camera for a cell."""

from __future__ import annotations

import contextlib
import itertools
import threading
import time
from collections.abc import Sequence
from typing import Any, Protocol

from corbot import _orb
from corbot.cell import Sighting


class Camera(Protocol):
    """The interface of a custom camera. An exception of either method becomes a NotReady for the client."""

    def look(self, timeout: float) -> Sequence[Sighting]:
        """Take a picture within `timeout` seconds.

        Return the pieces in it, in the world frame of the cell, metres.
        """

    def picture(self, marked: bool) -> bytes:
        """Give the last picture as a JPEG file; `marked`: with the findings drawn in."""


def serve_camera(camera: Camera, port: int, *, host: str = "127.0.0.1") -> None:
    """Serve a camera at `corbaloc::HOST:PORT/Camera` until Ctrl-C.

    The function returns when the last call has its answer, and the ORB's threads have ended after up to 2 s.

    cell.toml names it: `camera = { reference = "corbaloc::127.0.0.1:PORT/Camera" }`. Call this before any
    other function of the package: an ORB listens from its start, or not at all. A later call raises
    RuntimeError.
    """
    try:
        orb = _orb.orb("-ORBendPoint", f"giop:tcp:{host}:{port}")
    except RuntimeError as error:
        told = (
            f"Port {port} would not be open: this process used corbot before. "
            "Serve the camera in a process of its own."
        )
        raise RuntimeError(told) from error
    poa = orb.resolve_initial_references("omniINSPOA")
    poa.activate_object_with_id(b"Camera", _Servant(camera))
    poa._get_the_POAManager().activate()
    with contextlib.suppress(KeyboardInterrupt):
        while True:  # the ORB serves in its own threads; this one stays free for Ctrl-C
            time.sleep(0.2)  # a Ctrl-C just before a sleep does not shorten it
    ending = threading.Thread(target=_orb.end, daemon=True)  # a second Ctrl-C does not wait for it
    ending.start()
    ending.join()


class _Servant(_orb.Corbot__POA.Camera):  # type: ignore[misc]
    """The object that the cell calls."""

    def __init__(self, camera: Camera) -> None:
        self._camera, self._numbers = camera, itertools.count(1)

    def Look(self, timeout: float) -> Any:  # noqa: N802
        if not 0.1 <= timeout <= 60.0:
            raise _orb.Corbot.BadParameter("timeout", timeout, "a look takes 0.1 to 60 seconds")
        begun = time.time()
        try:
            pieces = [_sighting(piece) for piece in self._camera.look(timeout)]
        except (Exception, SystemExit) as error:
            raise _not_ready(error) from error
        return _orb.Corbot.Frame(next(self._numbers), (begun + time.time()) / 2.0, pieces)

    def Picture(self, marked: bool) -> bytes:  # noqa: N802
        try:
            return bytes(self._camera.picture(bool(marked)))
        except (Exception, SystemExit) as error:
            raise _not_ready(error) from error


def _sighting(piece: Sighting) -> Any:
    if not isinstance(piece.kind, str):
        raise TypeError(f"A sighting's kind is a text, not {piece.kind!r}")
    position = _orb.Corbot.Point(*(float(number) for number in piece.position))
    return _orb.Corbot.Sighting(piece.kind, position, float(piece.yaw), float(piece.confidence))


def _not_ready(error: BaseException) -> Exception:
    text = f"{type(error).__name__}: {error}".encode("ascii", "replace").decode().replace("\0", "?")
    refusal: Exception = _orb.Corbot.NotReady(text)
    return refusal
