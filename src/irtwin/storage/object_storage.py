"""Files of a workspace in object storage that speaks S3, each there whole or not at all.

Credentials, region and the server's address are those that botocore finds (`AWS_ACCESS_KEY_ID`, `AWS_PROFILE`,
`AWS_ENDPOINT_URL`, ...): none is an argument here, and no message repeats what a server or botocore says.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from irtwin.errors import InputError, WorkspaceFault

_OWNER = "irtwin-workspace"  # the object that says whose files these are
_BLOCK = 1 << 20  # bytes read at once: what a row group has of one channel
_URL = re.compile(r"s3://[a-z0-9][a-z0-9.-]{1,61}[a-z0-9](/[^\x00-\x1f\x7f/*?\[\]]+)*/?")


class StorageFault(WorkspaceFault):
    """Object storage that cannot be used just now, or not by this user."""


class ObjectStorage:
    """The objects below a URL such as `s3://bucket/prefix`, each by its path below it.

    Every method raises StorageFault where there is no such bucket, the keys do not let us in, or nobody answers.
    """

    def __init__(self, url: str) -> None:
        """Take a URL; nothing is asked of the server yet. Raises InputError where it is none, or s3fs is missing."""
        self.url = checked_url(url)
        self.files = _filesystem()
        self._root = self.url.removeprefix("s3://")

    def address(self, path: str) -> str:
        """Return the whole URL of an object."""
        return f"{self.url}/{path}"

    def owner(self) -> str | None:
        """Return who said that these are its files, None where nobody did."""
        said = self.content(_OWNER)
        return None if said is None else said.decode("utf-8", "replace")

    def claim(self, owner: str) -> None:
        """Say whose files these are. Raises InputError where they are another's."""
        with self._told(), suppress(FileExistsError):
            self.files.pipe_file(self._at(_OWNER), owner.encode(), mode="create")
        if self.owner() != owner:
            raise InputError(f"{self.url}: holds the series of another workspace; choose another prefix")

    def release(self) -> None:
        """Let these be nobody's files."""
        self.remove([_OWNER])

    def paths(self, folder: str) -> set[str]:
        """Return the objects of a folder, by their paths."""
        with self._told():
            found = self.files.find(self._at(folder))
        return {str(path).removeprefix(f"{self._root}/") for path in found}

    def put(self, files: Mapping[str, Path]) -> None:
        """Write files, by the path that each gets, several at a time."""
        if files:
            with self._told():
                self.files.put([str(file) for file in files.values()], [self._at(path) for path in files])

    def fetch(self, files: Mapping[str, Path]) -> None:
        """Write objects, by their paths, into files, several at a time. FileNotFoundError where one is not there."""
        if files:
            with self._told():
                self.files.get([self._at(path) for path in files], [str(file) for file in files.values()])

    def remove(self, paths: Iterable[str]) -> None:
        """Remove objects."""
        with self._told():
            for path in paths:
                self.files.rm_file(self._at(path))

    def content(self, path: str) -> bytes | None:
        """Return an object's bytes; None where there is none."""
        with self._told():
            try:
                return bytes(self.files.cat_file(self._at(path)))
            except FileNotFoundError as error:
                if _code(error) == "NoSuchBucket":
                    raise
                return None

    def checksum(self, path: str) -> str | None:
        """Return the SHA-256 of an object's bytes, in hexadecimal; None where there is none."""
        with self.opened(path) as stream:
            return None if stream is None else _sha256(stream)

    @contextmanager
    def opened(self, path: str) -> Iterator[IO[bytes] | None]:
        """Give an object that is read in parts; None where there is none."""
        with self._told():
            try:
                stream = self.files.open(self._at(path), "rb")
            except FileNotFoundError:
                yield None
                return
            with stream:
                yield stream

    def _at(self, path: str) -> str:
        return f"{self._root}/{path}"

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Raise StorageFault, in words of ours, for what the server or the way to it refuses."""
        from botocore.exceptions import BotoCoreError, NoCredentialsError, PartialCredentialsError

        try:
            yield
            return
        except FileNotFoundError:
            what = "there is no such bucket, or an object of it has just gone; correct the URL, or try again"
        except PermissionError:
            what = "the server refuses these keys, or what they ask; check AWS_... and what the bucket allows"
        except (NoCredentialsError, PartialCredentialsError):
            what = "no keys were found; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_PROFILE"
        except BotoCoreError as error:
            what = f"the server cannot be reached ({type(error).__name__}); check AWS_ENDPOINT_URL and the network"
        except OSError as error:
            said = _code(error) or type(error).__name__
            what = f"the server does not do what it is asked ({said}); try again, or ask who runs it"
        raise StorageFault(f"{self.url}: {what}") from None


def checked_url(url: str) -> str:
    """Return the URL of a bucket or a prefix in it, without a `/` at its end. InputError, without it, where it is none.

    What a wrong one holds may be a key, so it is not repeated.
    """
    if not _URL.fullmatch(url) or {".", ".."} & set(url.split("/")):
        raise InputError(
            "--series: write object storage as s3://bucket/prefix, without keys, port or query; keys and the server's "
            "address come from the environment (AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_ENDPOINT_URL)"
        )
    return url.rstrip("/")


@lru_cache(maxsize=1)
def _filesystem() -> Any:
    try:
        import fsspec
        import s3fs  # noqa: F401  fsspec would say so less clearly
    except ModuleNotFoundError:
        raise InputError('series in object storage need s3fs; pip install "irtwin[s3]"') from None
    return fsspec.filesystem(  # others write too, so no listing is kept
        "s3", use_listings_cache=False, default_block_size=_BLOCK, default_cache_type="readahead"
    )


def _code(error: OSError) -> str | None:
    """Return S3's own word for an error, where the server said one."""
    said = getattr(error.__cause__, "response", None)
    return said.get("Error", {}).get("Code") if isinstance(said, dict) else None


def _sha256(stream: IO[bytes]) -> str:
    whole = hashlib.sha256()
    while block := stream.read(_BLOCK):
        whole.update(block)
    return whole.hexdigest()
