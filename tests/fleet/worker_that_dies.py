"""`python -m tests.fleet.worker_that_dies BATCH`: a worker whose process ends on a data set named large."""

import os
import sys
from pathlib import Path
from types import SimpleNamespace

import irtwin
from irtwin.fleet.batch import Batch


def diagnose(data_set: Path, json_file: Path, twin_file: Path) -> None:
    if data_set.name == "large":
        os._exit(9)


irtwin.diagnosing = SimpleNamespace(diagnose=diagnose)  # type: ignore[assignment]  # of which nothing else is asked
Batch(Path(sys.argv[1])).work()
