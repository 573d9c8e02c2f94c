"""What a page carries, made small: scripts as gzip, samples as 16-bit integers, and fewer of them."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypedDict

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from irtwin import resources

Samples = npt.NDArray[np.float64]

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


def pack(values: Samples) -> Packed:
    """Quantise values to 1/65534 of their range, an eighth of a pixel's hair on any screen."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    offset, scale = (low + high) / 2, (high - low) / _LEVELS or 1.0
    steps = np.where(np.isfinite(values), np.round((values - offset) / scale), _MISSING)
    return Packed(scale=scale, offset=offset, data=base64_text(steps.astype("<i2")))


def extremes(signals: Sequence[Samples], points: int) -> npt.NDArray[np.intp]:
    """Return at most `points` rising indices that keep each signal's minimum and maximum in every stretch.

    signals: each (N,), of one time base; NaN samples are passed over. With `points` >= N all indices are kept.
    """
    count = len(signals[0])
    if count <= points:
        return np.arange(count)
    stretches = max(1, (points - 2) // (2 * len(signals)))
    width = -(-count // stretches)
    picked = [np.array([0, count - 1])]
    for signal in signals:
        padded = np.pad(signal, (0, width * stretches - count), constant_values=np.nan).reshape(stretches, width)
        starts = np.arange(stretches) * width
        picked.append(starts + np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1))
        picked.append(starts + np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1))
    indices = np.unique(np.concatenate(picked))
    return indices[indices < count]


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
