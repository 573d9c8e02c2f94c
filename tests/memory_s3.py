"""What the product takes for S3, in the memory of the tests' own process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import pytest
from fsspec.implementations.memory import MemoryFileSystem

from irtwin.storage import object_storage, series_place, windows


class MemoryS3(MemoryFileSystem):  # type: ignore[misc]
    """Objects by bucket and key."""

    protocol = "s3"
    store: ClassVar[dict[str, Any]] = {}
    pseudo_dirs: ClassVar[list[str]] = [""]
    cachable = False

    @classmethod
    def _strip_protocol(cls, path: str) -> str:
        return str(super()._strip_protocol(path.removeprefix("s3://")))

    def find(self, path: str, *arguments: Any, **options: Any) -> list[str]:
        return [found.lstrip("/") for found in super().find(path, *arguments, **options)]


@contextmanager
def memory_s3(monkeypatch: pytest.MonkeyPatch) -> Iterator[MemoryS3]:
    """Let all object storage be in memory, and be forgotten at the end."""
    objects = MemoryS3()
    monkeypatch.setattr(object_storage, "_filesystem", lambda: objects)
    forget()
    try:
        yield objects
    finally:
        MemoryS3.store.clear()
        MemoryS3.pseudo_dirs[:] = [""]
        forget()


def forget() -> None:
    """Open again what was opened."""
    for known in (series_place._storage, windows.open_series, windows._database):
        known.cache_clear()
