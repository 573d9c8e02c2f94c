"""A process without a network: what runs somebody's SPARQL has no use for one.

A filter of the Linux kernel (seccomp) refuses sockets to this process, for good. It stands behind the check of the
text, for the day that one of them is wrong.
"""

from __future__ import annotations

import ctypes
import errno
import platform
import struct
import sys

# By machine: its name in a filter, and its numbers of socket, connect, io_uring_setup and seccomp.
_MACHINES = {"x86_64": (0xC000003E, 41, 42, 425, 317), "aarch64": (0xC00000B7, 198, 203, 425, 277)}
_OTHER_NUMBERS = 0x40000000  # x86_64's second set of them, x32, begins here
_NO_NEW_PRIVILEGES, _SET_FILTER, _ALL_THREADS = 38, 1, 1
_LOAD, _EQUAL, _AT_LEAST, _RETURN = 0x20, 0x15, 0x35, 0x06
_ALLOW, _FAIL = 0x7FFF0000, 0x00050000


class _Program(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p)]


def leave_network() -> bool:
    """Refuse sockets to this process, all its threads and what it starts, for good; False where the system cannot.

    Files, and pipes and connections that are open already, go on as they were.
    """
    machine = _MACHINES.get(platform.machine())
    if sys.platform != "linux" or machine is None or sys.maxsize < 1 << 32:
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    filter_ = _filter(*machine[:-1])
    program = _Program(len(filter_) // 8, filter_)
    if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) != 0:
        return False
    number = ctypes.c_long(machine[-1])
    return bool(libc.syscall(number, _SET_FILTER, _ALL_THREADS, ctypes.byref(program)) == 0)


def _filter(name: int, socket: int, connect: int, io_uring: int) -> bytes:
    """Return the filter's instructions: operation, steps if true, steps if false, operand."""
    refuse = _FAIL | errno.EACCES
    lines = [
        (_LOAD, 0, 0, 4),  # the machine that the call is made for
        (_EQUAL, 0, 6, name),
        (_LOAD, 0, 0, 0),  # the call's number
        (_AT_LEAST, 4, 0, _OTHER_NUMBERS),
        (_EQUAL, 3, 0, socket),
        (_EQUAL, 2, 0, connect),
        (_EQUAL, 1, 0, io_uring),
        (_RETURN, 0, 0, _ALLOW),
        (_RETURN, 0, 0, refuse),
    ]
    return b"".join(struct.pack("HBBI", *line) for line in lines)
