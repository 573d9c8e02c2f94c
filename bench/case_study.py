"""How long `irtwin demo --case-study` takes, in a process of its own, and how near its plan came.

In bench/: `python case_study.py`
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from irtwin.asking import ask


def main() -> None:
    """Run the command once; print time, size of the page, and energies."""
    with tempfile.TemporaryDirectory() as folder:
        workspace = Path(folder) / "study"
        began = time.monotonic()
        command = [sys.executable, "-m", "irtwin", "demo", "--case-study", "--workspace", str(workspace)]
        subprocess.run(command, check=True)
        wall, used = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        (row,) = ask("planned_against_measured", workspace).rows
        size = (workspace / "reports" / "case_study.html").stat().st_size
        print(f"{wall:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of processor, {used.ru_maxrss / 1e3:.0f} MB")
        print(f"page {size / 1e6:.2f} MB; planned {row['planned_Wh']:.3f} Wh, measured {row['measured_Wh']:.3f} Wh")


if __name__ == "__main__":
    main()
