"""`python -m irtwin.fleet BATCH`: work through one batch; a process of its own does this for the fleet."""

import sys
from pathlib import Path

from irtwin.fleet.batch import Batch

Batch(Path(sys.argv[1])).work()
