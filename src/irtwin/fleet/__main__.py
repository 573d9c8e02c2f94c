"""`python -m irtwin.fleet BATCH`: work through one batch; a process of its own does this for the fleet."""

import sys
from pathlib import Path

from irtwin.errors import InputError
from irtwin.fleet.batch import STOPPED, Batch

try:
    Batch(Path(sys.argv[1])).work()
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(STOPPED)
