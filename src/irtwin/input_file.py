"""Files that a user names, read with a bound: no pipe that never ends, no device, nothing that fills the memory."""

from __future__ import annotations

import hashlib
import stat
from contextlib import suppress
from pathlib import Path

from irtwin.errors import InputError

_ALWAYS, _TIMES = 64_000_000, 10  # bytes that a packed file may unpack to, and how many times its own size beside


class Unpacking:
    """What a packed file unpacks to, counted before it does, for a few kB may hold gigabytes.

    Logs shrink less than tenfold; one that shrinks more is let pass up to 64 MB.
    """

    def __init__(self, path: Path, packed: int) -> None:
        self.path, self.packed = path, packed
        self.most = _ALWAYS + _TIMES * packed
        self.left = self.most

    def take(self, size: int, part: str, remedy: str) -> None:
        """Count some bytes more. Raises InputError, naming the part that is too much."""
        self.left -= size
        if self.left < 0:
            raise InputError(
                f"{self.path}: {part}: more than the {self.most // 1_000_000} MB that a file of this size may unpack "
                f"to; {remedy}"
            )


def real_path(path: Path) -> Path | None:
    """Return where a path leads; None where its links go round in a circle, a name is too long or has a NUL."""
    try:
        real = path.resolve()
        with suppress(FileNotFoundError, NotADirectoryError):
            real.stat()
        return real
    except (OSError, RuntimeError, ValueError):  # Python 3.13 has the former for a circle, those before the latter
        return None


def read_input(path: Path, most: int) -> bytes:
    """Return a file's content. Raises InputError where it cannot be read or has more than `most` bytes."""
    if check_file(path) > most:
        raise InputError(
            f"{path}: is larger than the {most // 1_000_000} MB limit for such a file; give a smaller file"
        )
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); name an existing file") from error


def read_text(path: Path, most: int, remedy: str = "save it as UTF-8") -> str:
    """Return the content of a text file, without a byte order mark. Raises InputError as `read_input` and `as_text`."""
    return as_text(path, read_input(path, most), remedy)


def as_text(path: Path, content: bytes, remedy: str = "save it as UTF-8") -> str:
    """Return what a file holds as text, without a byte order mark; `remedy` is what to do where it holds none.

    Raises InputError where it is not UTF-8: from which byte of which line on, both counted from 1.
    """
    try:
        return content.decode().removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        *before, last = content[: error.start].split(b"\n")
        raise InputError(f"{path}, line {len(before) + 1}: not UTF-8 text (byte {len(last) + 1}); {remedy}") from error


def checksum(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal; of a folder, that of its files' names and checksums."""
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    files = sorted(entry for entry in path.iterdir() if entry.is_file())
    return hashlib.sha256("\n".join(f"{entry.name} {checksum(entry)}" for entry in files).encode()).hexdigest()


def check_file(path: Path) -> int:
    """Return a file's size in bytes. Raises InputError where it is not there, or no plain file."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{path}: is not a file; name the file with the input")
        return status.st_size
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); name an existing file") from error
    except ValueError as error:  # a null byte in the name
        raise InputError(f"{str(path)!r}: is not a file name: {error}") from error
