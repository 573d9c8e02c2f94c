"""Files that a user names, read with a bound: no pipe that never ends, no device, nothing that fills the memory."""

from __future__ import annotations

import hashlib
import stat
from pathlib import Path

from irtwin.errors import InputError


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


def checksum(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal; of a folder, that of its files' names and checksums."""
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    files = sorted(one for one in path.iterdir() if one.is_file())
    return hashlib.sha256("\n".join(f"{one.name} {checksum(one)}" for one in files).encode()).hexdigest()


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
