"""Write the lines of each room into the table of docs/findings/rooms.md: `python bench/rooms.py`.

A file counts in the row with the innermost folder that holds it, one of no row's folder among the jobs at the top.
"""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "irtwin"
PAGE = ROOT / "docs" / "findings" / "rooms.md"
_ROW = re.compile(r"^\| (.+?) \| [\d,]+ \|", re.MULTILINE)
_TOTAL = re.compile(r"[\d,]+ in [\d,]+ files")


def written(page: str, lines: dict[str, int]) -> str:
    """Return the page with the lines of files, by their paths below src/irtwin."""
    row_of = {room: row for row in _ROW.findall(page) for room in re.findall("`(.+?)`", row) or [""]}
    total = Counter[str]()
    for path, count in lines.items():
        inside = [room for room in row_of if not room or path.startswith(f"{room}/")]
        total[row_of[max(inside, key=len)]] += count
    page = _ROW.sub(lambda row: f"| {row[1]} | {total[row[1]]:,} |", page)
    return _TOTAL.sub(f"{total.total():,} in {len(lines)} files", page, count=1)


def main() -> None:
    """Count what git tracks."""
    listed = ["git", "ls-files", "-z", "--", "*.py"]
    paths = subprocess.run(listed, cwd=SOURCE, capture_output=True, text=True, check=True).stdout.split("\0")
    lines = {path: len((SOURCE / path).read_bytes().splitlines()) for path in paths if path}
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), lines), encoding="utf-8")


if __name__ == "__main__":
    main()
