"""URLs of object storage, and what is said where it cannot be used."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from botocore.exceptions import EndpointConnectionError, NoCredentialsError
from tests.memory_s3 import MemoryS3, memory_s3

from irtwin.errors import InputError
from irtwin.storage.object_storage import ObjectStorage, StorageFault, checked_url

SECRET = "wJalrXUtnFEMI"


@pytest.fixture
def objects(monkeypatch: pytest.MonkeyPatch) -> Iterator[MemoryS3]:
    with memory_s3(monkeypatch) as made:
        yield made


@pytest.mark.parametrize("url", ["s3://plant", "s3://plant-1/Halle 1/Röbots", "s3://plant/a+b #1 %20/x/"])
def test_buckets_and_prefixes_are_taken(url: str) -> None:
    assert checked_url(url) == url.rstrip("/")


@pytest.mark.parametrize(
    "url",
    [
        "series",
        "https://plant.example/series",
        "s3://",
        "s3:///prefix",
        f"s3://key:{SECRET}@plant/series",
        f"s3://plant/series?secret={SECRET}",
        "s3://plant:9000/series",
        "s3://plant/../other",
        "s3://plant//series",
        "s3://plant/se\nries",
        "s3://plant/*",
        "s3://pl/a::s3://other",
    ],
)
def test_what_is_no_place_is_refused_and_not_repeated(url: str) -> None:
    with pytest.raises(InputError, match="write object storage as s3://bucket/prefix") as refused:
        checked_url(url)
    assert SECRET not in str(refused.value)


def test_a_prefix_has_one_owner(objects: MemoryS3) -> None:
    storage = ObjectStorage("s3://plant/line 1")
    assert storage.owner() is None
    storage.claim("a")
    storage.claim("a")
    with pytest.raises(InputError, match="another workspace; choose another prefix"):
        storage.claim("b")
    storage.release()
    storage.claim("b")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (FileNotFoundError("The specified bucket does not exist"), "there is no such bucket"),
        (PermissionError(f"denied {SECRET}"), "the server refuses these keys"),
        (NoCredentialsError(), "no keys were found; set AWS_ACCESS_KEY_ID"),
        (EndpointConnectionError(endpoint_url=f"http://me:{SECRET}@host"), r"cannot be reached \(EndpointConnection"),
        (OSError(f"slow down {SECRET}"), r"does not do what it is asked \(OSError\)"),
    ],
)
def test_a_fault_is_one_line_without_secrets(
    objects: MemoryS3, monkeypatch: pytest.MonkeyPatch, error: Exception, said: str
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(objects, "find", fail)
    with pytest.raises(StorageFault, match=said) as told:
        ObjectStorage("s3://plant/line 1").paths("series")
    assert str(told.value).startswith("s3://plant/line 1: ")
    assert SECRET not in str(told.value)
    assert "\n" not in str(told.value)
