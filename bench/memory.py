"""Memory of this process."""

from __future__ import annotations

from pathlib import Path


def most_used() -> int:
    """Return the most memory that this process held, in bytes.

    `resource.getrusage` begins with what its parent held when it was started, which may be more.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) * 1024
