"""What lies around the folder of a case: no command may write there, and none may tell what it says."""

from __future__ import annotations

from pathlib import Path

SECRET = "k3p7-told-to-nobody"
_DEPTH = 4  # folders above that of the case, for paths that lead up
_NAMES = ("x", "x.html", "x.json", "mine.ttl", "mine.run.journal", "secret.toml", "secret.html.jinja", "etc/passwd")


class Outside:
    """Folders below `root`, one in another, with files in each; the case's own is the innermost."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self.case = root.joinpath("above", *map(str, range(_DEPTH)), "case")
        self.case.mkdir(parents=True)
        for folder in self.case.parents[: _DEPTH + 2]:
            (folder / "etc").mkdir()  # links lead there: those to the machine's own would have a draw write to it
            for name in _NAMES:
                (folder / name).write_text(f'word = "{SECRET}"\n')
        self._were = self._there()

    def seal(self) -> None:
        """Take what is there for what no command may change: spoiling a case has written through its links."""
        self._were = self._there()

    def changed(self) -> str | None:
        """Return a path outside that a command has written or removed; None where it left all as it was."""
        now = self._there()
        other = {name for name in now.keys() | self._were.keys() if now.get(name) != self._were.get(name)}
        return min(other, default=None)

    def _there(self) -> dict[str, bytes | None]:
        own = str(self.case)
        files = (file for file in self._root.rglob("*") if not str(file).startswith(own))
        return {str(file.relative_to(self._root)): file.read_bytes() if file.is_file() else None for file in files}
