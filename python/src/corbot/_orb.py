# SPDX-License-Identifier: Apache-2.0
"""The only module that uses omniORB. Makes calls, and converts the interface's exceptions to Python's."""

from __future__ import annotations

import _signal  # private, but no public module has it; the enumerations of signal.signal cost 8 us a call
import atexit
import contextlib
import os
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any
from urllib.parse import unquote

import CosNaming
import omniORB
from omniORB import CORBA

import corbot._stubs.Corbot as Corbot
import corbot._stubs.Corbot__POA as Corbot__POA
from corbot.errors import (
    BadAddress,
    BadParameter,
    CorbotError,
    Disconnected,
    LimitExceeded,
    NoAnswer,
    NoControl,
    NotReady,
    OrbError,
    QueueFull,
    RobotNotFound,
    Stopped,
    Unreachable,
)
from corbot.poses import Point

__all__ = ["MOST_JOINTS", "Corbot", "Corbot__POA", "call", "connect", "orb", "set_timeout", "uninterrupted"]

MOST_JOINTS: int = Corbot._tc_JointCoord.content_type().length()
"""How many values a list of joints has at most, whatever the arm."""


_LAST_CALLS = 2.0  # seconds; the calls that wait for a motion return after 0.1 s on an idle machine
_HELD_BACK = 10.0  # seconds, in which Python ends
_IDLE_THREADS = 1  # seconds; after twice as long without a call a thread of the ORB ends
_KEPT_CONNECTIONS = 5  # omniORB's maxGIOPConnectionPerServer

_threads_inside: set[int] = set()  # the threads, except the main one, that are inside the ORB
_python_threads: set[int] = set()  # the kernel's numbers of the ORB's threads that have run Python
_is_started = False
_is_forked = False
_is_ending = False


class uninterrupted:  # noqa: N801
    """Defer Ctrl-C, and the end of Python, until the end of the block.

    An exception that a signal handler raises inside the ORB would leave a reply half-read. A thread that
    returns from the ORB while Python ends would abort the process.
    """

    __slots__ = ("_held", "_previous")

    def __enter__(self) -> None:
        if _is_forked:
            raise RuntimeError(
                "A process that used corbot has forked this one, so corbot does not work here. "
                "Start it with multiprocessing.get_context('spawn'), or before the first call of corbot."
            )
        self._held: tuple[int, FrameType | None] | None = None
        self._previous: Any = None
        if (thread := threading.get_ident()) != threading.main_thread().ident:
            _threads_inside.add(thread)
            if _is_ending:
                _threads_inside.discard(thread)
                time.sleep(_HELD_BACK)
            return
        previous = _signal.getsignal(_signal.SIGINT)
        if callable(previous):  # else it is ignored, or a handler that Python could not restore
            self._previous = previous
            _signal.signal(_signal.SIGINT, self._hold)

    def __exit__(self, *_: object) -> None:
        _threads_inside.discard(threading.get_ident())
        if self._previous is None:
            return
        _signal.signal(_signal.SIGINT, self._previous)
        if self._held is not None:
            self._previous(*self._held)

    def _hold(self, number: int, frame: FrameType | None) -> None:
        self._held = (number, frame)


def _await_other_threads() -> None:
    """Let other threads leave the ORB, and let none enter, before Python ends."""
    global _is_ending
    _is_ending = True
    end = time.monotonic() + _LAST_CALLS
    while _threads_inside and time.monotonic() < end:
        time.sleep(0.001)


def _note_fork() -> None:
    """Note in a child that the connections are its parent's: the two would read each other's replies."""
    global _is_forked
    _is_forked = _is_started
    _threads_inside.clear()


def _note_python_thread(*_: object) -> None:
    _python_threads.add(threading.get_native_id())


atexit.register(_await_other_threads)
omniORB.addWThreadHook(_note_python_thread)
os.register_at_fork(after_in_child=_note_fork)


def orb(*options: str) -> Any:
    """Give the ORB of this process.

    Options, such as the address to listen on, belong to the first call; later calls refuse them.
    """
    global _is_started
    if options and _is_started:
        raise RuntimeError(
            f"The ORB of this process has started, and takes no options now, not {' '.join(options)}."
        )
    options = (*options, "-ORBidleThreadTimeout", str(_IDLE_THREADS))
    started = CORBA.ORB_init(list(options), CORBA.ORB_ID)
    _is_started = True
    return started


def end() -> None:
    """End the ORB after the calls that it serves, and wait up to 4 s for the threads that served them.

    Such a thread runs Python in its last step, which aborts the process while Python ends. The ORB's
    `destroy` would not do: it may free what such a thread still uses.
    """
    orb().shutdown(True)
    latest = time.monotonic() + 2 * _IDLE_THREADS + _LAST_CALLS
    while sum(map(_is_alive, _python_threads)) > 1 and time.monotonic() < latest:  # omniORB keeps one
        time.sleep(0.001)


def _is_alive(thread: int) -> bool:
    return os.path.exists(f"/proc/self/task/{thread}")


def connect(address: str, timeout: float, *interfaces: Any) -> Any:
    """Give the object at an address as the first of the interfaces that it supports.

    `timeout` bounds each call, seconds.
    """
    with uninterrupted():
        reference = _reference(address, timeout)
        set_timeout(reference, timeout)
        try:
            found = next(filter(None, (_ask(reference._narrow, each) for each in interfaces)), None)
        except CORBA.TRANSIENT as error:
            raise RobotNotFound(address, "nobody answers there") from error
        except CORBA.COMM_FAILURE as error:
            raise RobotNotFound(address, "what answers there closed the connection") from error
        except CORBA.OBJECT_NOT_EXIST as error:
            raise RobotNotFound(address, "a server answers there, but has no robot of that name") from error
        except CORBA.SystemException as error:
            raise system_error(error, address) from error
    if found is None:
        raise RobotNotFound(address, f"what answers there has not the interface {interfaces[-1].__name__}")
    set_timeout(found, timeout)
    return found


def _ask(operation: Callable[..., Any], *arguments: Any) -> Any:
    """Call an operation that changes nothing, again where a kept connection has been closed.

    The ORB keeps up to `_KEPT_CONNECTIONS` to a port. If that server has ended, another may listen there.
    """
    for _ in range(_KEPT_CONNECTIONS):
        with contextlib.suppress(CORBA.COMM_FAILURE):
            return operation(*arguments)
    return operation(*arguments)


def _reference(address: str, timeout: float) -> Any:
    """Give the reference of an address; a naming service resolves a corbaname."""
    context, _, name = address.partition("#")
    try:
        if not address.startswith("corbaname:") or not name:
            return orb().string_to_object(address)
        where = context.removeprefix("corbaname:")
        service = orb().string_to_object(
            f"corbaloc:{where}" if "/" in where else f"corbaloc:{where}/NameService"
        )
        set_timeout(service, timeout)
        return _ask(service._narrow, CosNaming.NamingContextExt).resolve_str(unquote(name))
    except (CORBA.TRANSIENT, CORBA.TIMEOUT, CORBA.COMM_FAILURE, CORBA.OBJECT_NOT_EXIST) as error:
        raise RobotNotFound(address, "no naming service answers there") from error
    except CORBA.UserException as error:
        raise RobotNotFound(address, f"the naming service there does not have the name {name}") from error
    except CORBA.SystemException as error:
        raise BadAddress(address) from error


def set_timeout(reference: Any, timeout: float) -> None:
    """Bound each call through the reference, seconds."""
    if not 0.001 <= timeout <= 3600.0:  # the ORB treats 0 as no bound
        raise ValueError(f"A timeout is from 0.001 to 3600 seconds, not {timeout:g}.")
    omniORB.setClientCallTimeout(reference, int(timeout * 1000))


def call(address: str, operation: Callable[..., Any], *arguments: Any) -> Any:
    """Call an operation; raise CorbotError."""
    with uninterrupted():
        try:
            return operation(*arguments)
        except CORBA.UserException as error:
            raise user_error(error) from None
        except (CORBA.BAD_PARAM, CORBA.DATA_CONVERSION) as error:  # the ORB could not encode them
            raise TypeError(
                f"The interface does not take the type, the length or the letters of {arguments!r:.200}"
            ) from error
        except CORBA.SystemException as error:
            if error.minor == omniORB.MARSHAL_SequenceIsTooLong:
                raise TypeError(
                    f"The interface does not take a list of such a length: {arguments!r:.200}"
                ) from error
            raise system_error(error, address) from error


def user_error(error: Any) -> CorbotError:
    """Give the Python exception for one that the interface declares."""
    match error:
        case Corbot.BadParameter():
            return BadParameter(error.parameter, error.value, error.reason)
        case Corbot.Unreachable():
            return Unreachable(Point(error.target.x, error.target.y, error.target.z), error.reason)
        case Corbot.LimitExceeded():
            return LimitExceeded(error.quantity, error.articulation, error.value, error.lower, error.upper)
        case Corbot.NotReady():
            return NotReady(error.reason)
        case Corbot.Stopped():
            return Stopped(error.reason)
        case Corbot.QueueFull():
            return QueueFull(error.capacity)
    return OrbError(type(error).__name__, 0)


def system_error(error: Any, address: str) -> CorbotError:
    """Give the Python exception for one that the ORB raises."""
    if isinstance(error, CORBA.TIMEOUT) or (
        isinstance(error, CORBA.TRANSIENT) and error.minor == omniORB.TRANSIENT_CallTimedout
    ):
        return NoAnswer(address)
    # A program that is about to end raises the last two.
    if isinstance(error, (CORBA.COMM_FAILURE, CORBA.TRANSIENT, CORBA.OBJ_ADAPTER, CORBA.OBJECT_NOT_EXIST)):
        return Disconnected(address)
    if isinstance(error, CORBA.NO_PERMISSION):
        return NoControl(has_ended=error.minor == Corbot.NoPermissionControlEnded)
    return OrbError(type(error).__name__, error.minor)
