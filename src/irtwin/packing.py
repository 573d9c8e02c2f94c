"""What a page carries, made small: scripts as gzip, samples as 16-bit integers."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import TypedDict

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from irtwin import resources

_LEVELS = 65_534  # of a 16-bit integer, symmetric about zero
_MISSING = -32_768  # stands for NaN


class Packed(TypedDict):
    """16-bit integers, little-endian, in base64: value = offset + scale * integer."""

    scale: float
    offset: float
    data: str


@dataclass(frozen=True)
class Fragment:
    """A piece of a page, and the scripts that may run in it, as a browser sees them."""

    html: Markup
    scripts: tuple[str, ...]


def pack(values: npt.NDArray[np.float64]) -> Packed:
    """Quantise values to 1/65534 of their range, an eighth of a pixel's hair on any screen."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    offset, scale = (low + high) / 2, (high - low) / _LEVELS or 1.0
    steps = np.where(np.isfinite(values), np.round((values - offset) / scale), _MISSING)
    return Packed(scale=scale, offset=offset, data=base64_text(steps.astype("<i2")))


def base64_text(values: npt.NDArray[np.generic]) -> str:
    """Return an array's bytes in base64."""
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def embedded_json(data: object) -> Markup:
    """Return JSON that no name in it can break out of inside a script element: without `<`, `>` and `&`."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)


def packed_scripts(scripts: Iterable[str]) -> Fragment:
    """Return elements that run scripts in their order once the page is there; a library takes a third of its size."""
    texts = tuple(scripts)
    unpack = (resources.folder("reports") / "layout" / "unpack.js").read_text(encoding="utf-8")
    elements = [f'<script type="application/gzip">{_gzipped(text)}</script>' for text in texts]
    return Fragment(Markup("\n".join([*elements, f"<script>{unpack}</script>"])), (*texts, unpack))


@cache
def _gzipped(text: str) -> str:
    return base64.b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")
