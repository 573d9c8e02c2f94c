"""A page whose templates do not all ship, made in a process that may take little time and memory.

A template is a programme: three loops, one in another, never end, and a text can be made to fill the memory. The values
go to the process pickled; the page comes back as JSON, for what runs there is not trusted.
"""

from __future__ import annotations

import json
import pickle
import signal
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

from irtwin.errors import InputError
from irtwin.limits import limit_memory, limit_processor_time
from irtwin.resources import Resources

_SECONDS = 30.0  # of the processor; of the clock twice that, as others use it too
_MEMORY = 1 << 30  # bytes


def written_apart(resources: Resources, template: str, values: Mapping[str, Any]) -> str:
    """Return the page that a template makes of values. Raises InputError where it fails, or takes too much."""
    answer = _said(pickle.dumps((resources, template, dict(values))))
    if "page" in answer:
        return str(answer["page"])
    raise InputError(f"{resources.path('reports', template)}: {answer['fault']}; see the files that extend reports/")


def _said(task: bytes) -> dict[str, str]:
    command = [sys.executable, "-m", __name__, str(_SECONDS), str(_MEMORY)]
    too_long = {"fault": f"takes more than {_SECONDS:g} s"}
    try:
        done = subprocess.run(command, input=task, stdout=subprocess.PIPE, timeout=2 * _SECONDS)
    except subprocess.TimeoutExpired:
        return too_long
    if done.returncode == -signal.SIGXCPU:
        return too_long
    done.check_returncode()
    answer: dict[str, str] = json.loads(done.stdout)
    return answer


def _answer(seconds: float, memory: int) -> str:
    from irtwin.report.templates import environment

    resources, template, values = pickle.load(sys.stdin.buffer)
    limit_memory(memory)
    limit_processor_time(seconds)
    try:
        return json.dumps({"page": environment(resources).get_template(template).render(**values)})
    except MemoryError:
        fault = f"needs more than {memory >> 20} MB of memory"
    except Exception as error:  # whatever somebody's template raises is that template's fault
        fault = f"{type(error).__name__}: {str(error)[:500]}"
    return json.dumps({"fault": fault})


if __name__ == "__main__":
    sys.stdout.write(_answer(float(sys.argv[1]), int(sys.argv[2])))
