"""Limits that the system holds a process to, for work that somebody else had the say in: a query, a template."""

from __future__ import annotations

import math
import resource
from pathlib import Path


def limit_memory(memory: int) -> None:
    """Have the system refuse this process more than so many bytes beside those that it has now."""
    sizes = Path("/proc/self/statm")  # in pages; the sixth is what RLIMIT_DATA counts
    has = int(sizes.read_text().split()[5]) * resource.getpagesize() if sizes.exists() else 0
    resource.setrlimit(resource.RLIMIT_DATA, (has + memory, has + memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def limit_processor_time(seconds: float) -> None:
    """Have the system end this process should it work for so many seconds more, even if who waits for it is gone."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    used = usage.ru_utime + usage.ru_stime
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(used + seconds) + 1, hard))
